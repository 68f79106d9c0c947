// The contracts, run on the fake family.

#include "control_board_contract.h"
#include "sensor_rigs.h"

namespace nido::test {
namespace {

INSTANTIATE_TEST_SUITE_P(Fake, ControlBoardContract,
                         testing::Values([] { return std::make_unique<FakeRig>(); }));
INSTANTIATE_TEST_SUITE_P(FakeUnderLimits, ControlBoardContract, testing::Values([] {
                           auto rig = std::make_unique<FakeRig>();
                           rig->put_limits();
                           return rig;
                         }));

INSTANTIATE_TEST_SUITE_P(Fake, CameraContract,
                         testing::Values([] { return std::make_unique<FakeCameraRig>(); }));

INSTANTIATE_TEST_SUITE_P(Fake, TouchContract,
                         testing::Values([] { return std::make_unique<FakeTouchRig>(); }));

TEST(FakeControlBoard, FailsOnDemand) {
  FakeControlBoard board(three_joints());
  const Error failure{ErrorCode::kFailed, "told to"};
  const int joint[] = {0};
  const double target[] = {0.1};
  board.set_failures({.commands = failure});
  EXPECT_EQ(board.move_to(joint, target).error().message, "told to");
  EXPECT_TRUE(board.read_joints().ok());
  board.set_failures({.reads = failure});
  EXPECT_TRUE(board.move_to(joint, target).ok());
  EXPECT_FALSE(board.read_joints().ok());
  EXPECT_FALSE(board.control_modes().ok());
  board.set_failures({.step = failure});
  EXPECT_FALSE(board.step_to(kPeriod_ns).ok());
  board.set_failures({});
  EXPECT_TRUE(board.step_to(kPeriod_ns).ok());
}

TEST(FakeControlBoard, FailsLaterWhenScheduled) {
  FakeControlBoard board(three_joints());
  board.schedule_failures(2 * kPeriod_ns, {.reads = Error{ErrorCode::kFailed, "told to"}});
  ASSERT_TRUE(board.step_to(kPeriod_ns).ok());
  EXPECT_TRUE(board.read_joints().ok());
  ASSERT_TRUE(board.step_to(2 * kPeriod_ns).ok());
  EXPECT_FALSE(board.read_joints().ok());
}

TEST(FakeControlBoard, ABrokenJointTakesNoCommandUntilRepaired) {
  FakeControlBoard board(three_joints());
  board.set_fault(1, true);
  const int both[] = {0, 1};
  const double targets[] = {0.5, 0.5};
  const Status refused = board.move_to(both, targets);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kFailed);
  EXPECT_NE(refused.error().message.find("elbow"), std::string::npos);
  EXPECT_NE(board.target_positions()->at(0), 0.5) << "the joint that is not broken moved all the same";
  EXPECT_EQ(board.control_modes()->at(1), ControlMode::kFault);
  board.set_fault(1, false);
  EXPECT_TRUE(board.move_to(both, targets).ok());
}

TEST(FakeWorld, CountsNothingAndRefusesTheRest) {
  FakeWorld world;
  EXPECT_EQ(world.command("world num box"), "0");
  EXPECT_EQ(world.command("world mk box 1 1 1").substr(0, 6), "[fail]");
}

}  // namespace
}  // namespace nido::test
