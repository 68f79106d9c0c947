// The limits layer: what no command may do, whatever it is.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "rigs.h"

namespace nido::test {
namespace {

// Notes what reaches the device below the layer, and checks it against the limits.
void expect_within_limits(FakeRig& rig, const JointReading& before) {
  const JointReading now = *rig.fake().read_joints();
  const std::vector<JointLimits> limits = *rig.fake().limits();
  for (std::size_t i = 0; i < limits.size(); ++i) {
    ASSERT_GE(now.position_rad[i], limits[i].min_rad - 1e-9) << i;
    ASSERT_LE(now.position_rad[i], limits[i].max_rad + 1e-9) << i;
    ASSERT_LE(std::abs(now.position_rad[i] - before.position_rad[i]),
              limits[i].max_velocity_rad_s * 0.01 + 1e-9)
        << i;
    ASSERT_LE(std::abs(now.torque_Nm[i]), limits[i].max_torque_Nm + 1e-9) << i;
  }
}

TEST(LimitedControlBoard, RandomCommandsNeverPassTheLimits) {
  FakeRig rig;
  rig.put_limits();
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> magnitude(-6, 6);
  const auto value = [&]() -> double {
    switch (random() % 8) {
      case 0:
        return std::numeric_limits<double>::quiet_NaN();
      case 1:
        return std::numeric_limits<double>::infinity();
      case 2:
        return (random() % 2 == 0 ? 1.0 : -1.0) * std::pow(10.0, magnitude(random));
      default:
        return magnitude(random) / 2;
    }
  };
  for (int period = 0; period < 20'000; ++period) {
    std::vector<int> joints;
    std::vector<double> values;
    for (std::uint64_t n = random() % 4; n > 0; --n) joints.push_back(static_cast<int>(random() % 5) - 1);
    for (std::uint64_t n = random() % 4; n > 0; --n) values.push_back(value());
    IControlBoard& board = rig.board();
    Status outcome;
    switch (random() % 10) {
      case 0:
        outcome = board.move_to(joints, values);
        break;
      case 1:
        outcome = board.set_positions(joints, values);
        break;
      case 2:
        outcome = board.set_velocities(joints, values);
        break;
      case 3:
        outcome = board.set_torques(joints, values);
        break;
      case 4:
        outcome = board.set_duty_cycles(joints, values);
        break;
      case 5:
        outcome = board.set_reference_speeds(joints, values);
        break;
      case 6:
        outcome = board.set_reference_accelerations(joints, values);
        break;
      case 7:
        outcome = board.stop(joints);
        break;
      case 8:
        outcome = board.set_control_mode(joints, static_cast<ControlMode>(random() % 7));
        break;
      default:
        break;
    }
    const JointReading before = *rig.fake().read_joints();
    rig.advance();
    expect_within_limits(rig, before);
    if (testing::Test::HasFatalFailure()) FAIL() << "in period " << period;
  }
}

TEST(LimitedControlBoard, ARefusedCommandChangesNothing) {
  FakeRig rig;
  rig.put_limits();
  const int joints[] = {0, 1};
  const double values[] = {0.3, std::numeric_limits<double>::quiet_NaN()};
  const std::vector<double> before = *rig.fake().target_positions();
  EXPECT_FALSE(rig.board().move_to(joints, values).ok());
  EXPECT_FALSE(rig.board().set_velocities(joints, values).ok());
  EXPECT_EQ(*rig.fake().target_positions(), before);
  EXPECT_EQ(rig.fake().control_modes()->at(0), ControlMode::kPosition);
}

class StreamTimeout : public testing::TestWithParam<ControlMode> {};

TEST_P(StreamTimeout, AJointStopsWhenItsCommandIsNotRenewed) {
  FakeRig rig;
  std::vector<std::string> reports;
  LimitOptions options;
  options.part = "arm";
  options.report = [&](const std::string& text) { reports.push_back(text); };
  rig.put_limits(options);
  const int joint[] = {0};
  const double value[] = {GetParam() == ControlMode::kDirect ? 1.4 : 0.5};
  const auto command = [&] {
    switch (GetParam()) {
      case ControlMode::kDirect:
        return rig.board().set_positions(joint, value);
      case ControlMode::kVelocity:
        return rig.board().set_velocities(joint, value);
      case ControlMode::kTorque:
        return rig.board().set_torques(joint, value);
      default:
        return rig.board().set_duty_cycles(joint, value);
    }
  };
  // renewed within the time: it goes on
  for (int period = 0; period < 20; ++period) {
    if (period % 6 == 0) {
      ASSERT_TRUE(command().ok());
    }
    rig.advance();
  }
  const double moving_rad = rig.board().read_joints()->position_rad[0];
  EXPECT_GT(moving_rad, 0.205);
  EXPECT_TRUE(reports.empty()) << reports.front();
  // never renewed again: it stands 100 ms after the last command, which was 20 ms ago
  for (int period = 0; period < 8; ++period) rig.advance();
  const double stopped_rad = rig.board().read_joints()->position_rad[0];
  for (int period = 0; period < 50; ++period) rig.advance();
  EXPECT_EQ(rig.board().read_joints()->position_rad[0], stopped_rad);
  EXPECT_EQ(rig.board().read_joints()->velocity_rad_s[0], 0);
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_NE(reports.front().find("arm joint 0: no new"), std::string::npos) << reports.front();
}
INSTANTIATE_TEST_SUITE_P(AllStreams, StreamTimeout,
                         testing::Values(ControlMode::kDirect, ControlMode::kVelocity, ControlMode::kTorque,
                                         ControlMode::kPwm),
                         [](const auto& mode) { return std::string(to_string(mode.param)); });

TEST(LimitedControlBoard, AMotionOfModePositionNeedsNoRenewal) {
  FakeRig rig;
  rig.put_limits();
  const int joint[] = {0};
  const double target[] = {1.2};
  ASSERT_TRUE(rig.board().move_to(joint, target).ok());
  for (int period = 0; period < 1000; ++period) rig.advance();
  EXPECT_NEAR(rig.board().read_joints()->position_rad[0], 1.2, 1e-9);
}

TEST(LimitedControlBoard, SlowsDownBeforeALimit) {
  FakeRig rig;
  rig.put_limits();
  const int joint[] = {0};
  const double speed[] = {2.0};
  double last_rad_s = 0;
  for (int period = 0; period < 300; ++period) {
    ASSERT_TRUE(rig.board().set_velocities(joint, speed).ok());
    rig.advance();
    last_rad_s = rig.board().read_joints()->velocity_rad_s[0];
  }
  EXPECT_NEAR(rig.board().read_joints()->position_rad[0], 1.5, 0.01);
  EXPECT_LT(last_rad_s, 0.05);
}

TEST(LimitedControlBoard, DropsATorqueThatPushesOutOfTheLimits) {
  FakeRig rig;
  rig.put_limits();
  const int joint[] = {2};
  const double torque[] = {2.0};
  for (int period = 0; period < 200; ++period) {
    ASSERT_TRUE(rig.board().set_torques(joint, torque).ok());
    rig.advance();
  }
  EXPECT_EQ(rig.board().read_joints()->torque_Nm[2], 0);
  const double back[] = {-2.0};
  ASSERT_TRUE(rig.board().set_torques(joint, back).ok());
  rig.advance();
  EXPECT_EQ(rig.board().read_joints()->torque_Nm[2], -2.0);
}

TEST(LimitedControlBoard, TakesTheNarrowerOfTwoLimits) {
  FakeRig rig;
  LimitOptions options;
  options.narrower = {{-0.5, 0.4, 1.0, 99.0}, {0.0, 9.0, 9.0, 9.0}, {-0.6, 0.6, 3.0, 2.0}};
  rig.put_limits(options);
  const std::vector<JointLimits> limits = *rig.board().limits();
  EXPECT_EQ(limits[0].min_rad, -0.5);
  EXPECT_EQ(limits[0].max_rad, 0.4);
  EXPECT_EQ(limits[0].max_velocity_rad_s, 1.0);
  EXPECT_EQ(limits[0].max_torque_Nm, 10.0);
  EXPECT_EQ(limits[1].min_rad, 0.2);
}

TEST(LimitedControlBoard, RefusesLimitsOutOfOrder) {
  FakeControlBoard fake(three_joints());
  const ManualClock clock;
  LimitOptions options;
  options.part = "arm";
  options.narrower = {{0.5, 9, 9, 9}, {5.0, 9, 9, 9}, {-9, 9, 9, 9}};
  const auto made = LimitedControlBoard::create(fake, clock, options);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("joint 1"), std::string::npos) << made.error().message;
}

TEST(LimitedControlBoard, ABrokenJointDoesNotStopTheOthers) {
  FakeRig rig;
  rig.put_limits();
  const int joints[] = {0, 1};
  const double targets[] = {1.0, 1.5};
  ASSERT_TRUE(rig.board().set_positions(joints, targets).ok());
  rig.fake().set_fault(1, true);
  for (int period = 0; period < 5; ++period) rig.advance();
  EXPECT_NEAR(rig.board().read_joints()->position_rad[0], 0.2 + 0.1, 1e-6);
}

TEST(DescribeLimits, SaysDegreesJointByJoint) {
  FakeControlBoard fake(three_joints());
  const std::vector<std::string> lines = describe_limits("arm", fake);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[2], "arm 2 wrist: -34.4..34.4 deg, 172 deg/s, 2 N m");
}

}  // namespace
}  // namespace nido::test
