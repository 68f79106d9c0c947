// Control of hand and gaze on fake boards, and by lines of text.

#include <fmt/format.h>

#include "nido/textproto/task_text.h"
#include "task_contracts.h"
#include "task_rig.h"

namespace nido::test {
namespace {

INSTANTIATE_TEST_SUITE_P(FakeUnderLimits, TaskContract,
                         testing::Values([] { return std::make_unique<FakeTaskRig>(); }));

// The same devices, asked by text.
class FakeByText final : public FakeTaskRig {
 public:
  ICartesianControl& hand() override { return *asked_hand_; }
  IGazeControl& gaze() override { return *asked_gaze_; }

 private:
  std::unique_ptr<ICartesianControl> asked_hand_ =
      asked_cartesian([this](const std::string& line) -> Result<std::string> {
        return cartesian_reply(FakeTaskRig::hand(), line);
      });
  std::unique_ptr<IGazeControl> asked_gaze_ =
      asked_gaze([this](const std::string& line) -> Result<std::string> {
        return gaze_reply(FakeTaskRig::gaze(), line);
      });
};
INSTANTIATE_TEST_SUITE_P(FakeByText, TaskContract,
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
  EXPECT_FALSE(rig.hand().state()->moving);
  EXPECT_FALSE(rig.gaze().state()->moving);
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
