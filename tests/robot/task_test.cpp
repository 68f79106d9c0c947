// Control of hand and gaze on fake boards, and by lines of text.

#include <fmt/format.h>

#include "frame_contract.h"
#include "nido/textproto/task_text.h"
#include "task_contracts.h"
#include "task_rig.h"

namespace nido::test {
namespace {

INSTANTIATE_TEST_SUITE_P(FakeUnderLimits, TaskContract,
                         testing::Values([] { return std::make_unique<FakeTaskRig>(); }));
INSTANTIATE_TEST_SUITE_P(FakeUnderLimits, FrameContract,
                         testing::Values([] { return std::make_unique<FakeTaskRig>(); }));

// The same devices, asked by text.
class FakeByText final : public FakeTaskRig {
 public:
  ICartesianControl& hand() override { return *asked_hand_; }
  IGazeControl& gaze() override { return *asked_gaze_; }
  IFrameTransforms& frames() override { return *asked_frames_; }

 private:
  std::unique_ptr<ICartesianControl> asked_hand_ =
      asked_cartesian([this](const std::string& line) -> Result<std::string> {
        return cartesian_reply(FakeTaskRig::hand(), line);
      });
  std::unique_ptr<IGazeControl> asked_gaze_ =
      asked_gaze([this](const std::string& line) -> Result<std::string> {
        return gaze_reply(FakeTaskRig::gaze(), line);
      });
  std::unique_ptr<IFrameTransforms> asked_frames_ =
      asked_frames([this](const std::string& line) -> Result<std::string> {
        return frames_reply(FakeTaskRig::frames(), line);
      });
};
INSTANTIATE_TEST_SUITE_P(FakeByText, TaskContract,
                         testing::Values([] { return std::make_unique<FakeByText>(); }));
INSTANTIATE_TEST_SUITE_P(FakeByText, FrameContract,
                         testing::Values([] { return std::make_unique<FakeByText>(); }));

TEST(TaskText, RefusesWhatItDoesNotUnderstandAndSaysWhatItDoes) {
  FakeTaskRig rig;
  for (const char* line :
       {"", "go", "go 1 2", "go 1 2 3 4", "go 1 2 3 in", "go 1 2 3 in soon", "go -0.2 0.1 0.1 1 1 1 1",
        "plan a b c", "get", "get state now", "dance", "stop now", "go (1 2 3)", "go \"", "plan 1e999 0 0"}) {
    EXPECT_EQ(cartesian_reply(rig.hand(), line).substr(0, 6), "[fail]") << line;
  }
  for (const char* line :
       {"", "look", "look at", "look at 1 2", "look at 1 2 3 4", "look pixel", "look pixel up 1 2 3",
        "look pixel left 1 2", "get", "stop now", "look at x y z"}) {
    EXPECT_EQ(gaze_reply(rig.gaze(), line).substr(0, 6), "[fail]") << line;
  }
  for (const char* line : {"", "get", "get frames now", "get transform", "get transform root_link",
                           "get transform root_link (r_hand)", "put root_link marker",
                           "put root_link marker 1 2 3", "put root_link marker 0 0 0 1 1 1 1",
                           "put root_link marker 0 0 0 0 0 0 one", "put root_link marker 0 0 0 0 0 0 1 2",
                           "remove", "remove marker", "put root_link \"a b\" 0 0 0 0 0 0 1", "move"}) {
    EXPECT_EQ(frames_reply(rig.frames(), line).substr(0, 6), "[fail]") << line;
  }
  EXPECT_FALSE(rig.hand().state()->moving);
  EXPECT_FALSE(rig.gaze().state()->moving);
}

// Boards whose readings do not come any more.
TEST(BodyFrames, EncodersThatAreTooOldSayNothing) {
  FakeTaskRig rig;
  rig.advance();
  ASSERT_TRUE(rig.frames().transform("root_link", "r_hand").ok());
  ASSERT_TRUE(rig.frames().put("r_hand", "tool", Eigen::Isometry3d::Identity()).ok());
  rig.let_encoders_age(kFramesTooOld_s + 0.1);
  const Result<FrameTransform> old = rig.frames().transform("root_link", "r_hand");
  ASSERT_FALSE(old.ok());
  EXPECT_EQ(old.error().code, ErrorCode::kFailed);
  EXPECT_TRUE(rig.frames().transform("r_hand", "tool").ok()) << "what is put there needs no encoders";
}

TEST(TaskControl, AnEmergencyStopEndsAndRefusesMotionsOfHandAndGaze) {
  FakeTaskRig rig;
  CartesianGoal goal;
  goal.X_RootPalm = rig.hand().state()->X_RootPalm;
  goal.X_RootPalm.translation() += Eigen::Vector3d(-0.03, 0, 0.1);
  ASSERT_TRUE(rig.hand().go_to(goal).ok());
  ASSERT_TRUE(rig.gaze().look_at({-0.5, 0.2, 0.1}).ok());
  for (int period = 0; period < 20; ++period) rig.advance();
  rig.safety()->stop("test");
  for (int period = 0; period < 20; ++period) rig.advance();
  EXPECT_FALSE(rig.hand().state()->moving);
  EXPECT_FALSE(rig.gaze().state()->moving);
  const Eigen::Vector3d there_m = rig.hand().state()->X_RootPalm.translation();
  EXPECT_FALSE(rig.hand().go_to(goal).ok());
  EXPECT_FALSE(rig.gaze().look_at({-0.5, -0.2, 0.1}).ok());
  for (int period = 0; period < 50; ++period) rig.advance();
  EXPECT_LT((rig.hand().state()->X_RootPalm.translation() - there_m).norm(), 1e-6);
  rig.safety()->clear();
  for (int period = 0; period < 2; ++period) rig.advance();
  EXPECT_TRUE(rig.hand().go_to(goal).ok());
}

TEST(TaskText, WhatPeopleType) {
  FakeTaskRig rig;
  const Eigen::Vector3d p = rig.hand().state()->X_RootPalm.translation();
  EXPECT_EQ(cartesian_reply(rig.hand(), fmt::format("go {} {} {} in 1", p.x() - 0.03, p.y(), p.z() + 0.05)),
            "[ok]");
  EXPECT_EQ(cartesian_reply(rig.hand(), "get state").substr(0, 10), "[is] state");
  EXPECT_EQ(cartesian_reply(rig.hand(), "stop"), "[ok]");
  EXPECT_EQ(gaze_reply(rig.gaze(), "look at -0.4 0.1 0.05"), "[ok]");
  EXPECT_EQ(gaze_reply(rig.gaze(), "stop"), "[ok]");
}

}  // namespace
}  // namespace nido::test
