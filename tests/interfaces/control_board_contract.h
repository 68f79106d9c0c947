#pragma once

// The contract of IControlBoard, run unchanged against every family of boards and against each of them
// through the network. Include it in one file of a test program and instantiate ControlBoardContract with a
// factory of rigs.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "control_board_rig.h"
#include "nido/interfaces/check_joints.h"
#include "nido/interfaces/control_board.h"

namespace nido::test {

using ControlBoardRigFactory = std::function<std::unique_ptr<ControlBoardRig>()>;

class ControlBoardContract : public testing::TestWithParam<ControlBoardRigFactory> {
 protected:
  void SetUp() override {
    rig_ = GetParam()();
    ASSERT_TRUE(eventually(2.0, [this] { return board().read_joints().ok(); }))
        << board().read_joints().error().message;
    joint_[0] = rig_->free_joint();
    limits_ = (*board().limits()).at(index());
  }

  IControlBoard& board() { return rig_->board(); }
  std::size_t index() const { return static_cast<std::size_t>(joint_[0]); }
  double position() { return board().read_joints()->position_rad.at(index()); }
  double velocity() { return board().read_joints()->velocity_rad_s.at(index()); }
  ControlMode mode() { return board().control_modes()->at(index()); }
  // A place inside the limits: 0 the lower one, 1 the upper one.
  double place(double part) const { return limits_.min_rad + part * (limits_.max_rad - limits_.min_rad); }

  // Lets time pass until something is true; false if it does not become so.
  bool eventually(double within_s, const std::function<bool()>& condition) {
    for (int period = 0; period < static_cast<int>(within_s * 100); ++period) {
      if (condition()) return true;
      rig_->advance();
    }
    return condition();
  }
  void pass(double duration_s) {
    for (int period = 0; period < static_cast<int>(duration_s * 100); ++period) rig_->advance();
  }
  // Commands again and again, as streaming modes need it.
  void stream(double duration_s, const std::function<Status()>& command) {
    for (int period = 0; period < static_cast<int>(duration_s * 100); ++period) {
      const Status sent = command();
      ASSERT_TRUE(sent.ok()) << sent.error().message;
      rig_->advance();
    }
  }
  // The same until it has an effect: on the way to a far robot a busy machine may hold up commands, and time
  // goes on meanwhile. Gives up when both have passed, the simulated and the wall time that it may take.
  void stream_until(const std::function<bool()>& condition, const std::function<Status()>& command) {
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    for (int period = 0; !condition(); ++period) {
      if (period >= 300 && std::chrono::steady_clock::now() > patience) return;
      const Status sent = command();
      ASSERT_TRUE(sent.ok()) << sent.error().message;
      rig_->advance();
    }
  }
  void go_to(double target_rad) {
    const double fast[] = {limits_.max_velocity_rad_s};
    const double target[] = {target_rad};
    ASSERT_TRUE(board().set_reference_speeds(joint_, fast).ok());
    ASSERT_TRUE(board().move_to(joint_, target).ok());
    ASSERT_TRUE(eventually(10.0,
                           [&] {
                             return std::abs(position() - target_rad) < rig_->tolerance_rad() &&
                                    std::abs(velocity()) < 0.02;
                           }))
        << "at " << position() << " instead of " << target_rad;
  }
  // Every command function, by name.
  using Command = std::function<Status(std::span<const int>, std::span<const double>)>;
  std::vector<std::pair<std::string, Command>> commands() {
    IControlBoard& b = board();
    return {
        {"move_to", [&b](auto j, auto v) { return b.move_to(j, v); }},
        {"set_reference_speeds", [&b](auto j, auto v) { return b.set_reference_speeds(j, v); }},
        {"set_reference_accelerations", [&b](auto j, auto v) { return b.set_reference_accelerations(j, v); }},
        {"set_positions", [&b](auto j, auto v) { return b.set_positions(j, v); }},
        {"set_velocities", [&b](auto j, auto v) { return b.set_velocities(j, v); }},
        {"set_torques", [&b](auto j, auto v) { return b.set_torques(j, v); }},
        {"set_duty_cycles", [&b](auto j, auto v) { return b.set_duty_cycles(j, v); }}};
  }
  void expect_refused(std::span<const int> joints, std::span<const double> values) {
    const std::vector<ControlMode> before = *board().control_modes();
    for (const auto& [name, command] : commands()) {
      const Status status = command(joints, values);
      EXPECT_FALSE(status.ok()) << name;
      if (!status.ok()) {
        EXPECT_EQ(status.error().code, ErrorCode::kInvalidArgument) << name << ": " << status.error().message;
        EXPECT_FALSE(status.error().message.empty()) << name;
      }
    }
    pass(0.05);
    EXPECT_EQ(*board().control_modes(), before) << "a refused command changed something";
  }

  std::unique_ptr<ControlBoardRig> rig_;
  int joint_[1] = {0};
  JointLimits limits_;
};

TEST_P(ControlBoardContract, JointsHaveDifferentNames) {
  ASSERT_GT(board().axes(), 0);
  std::set<std::string> names;
  for (int joint = 0; joint < board().axes(); ++joint) names.insert(*board().axis_name(joint));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(board().axes()));
  EXPECT_EQ(names.count(""), 0U);
  EXPECT_FALSE(board().axis_name(-1).ok());
  EXPECT_FALSE(board().axis_name(board().axes()).ok());
}

TEST_P(ControlBoardContract, EveryAnswerHasAValueForEachJoint) {
  const auto axes = static_cast<std::size_t>(board().axes());
  const JointReading reading = *board().read_joints();
  EXPECT_EQ(reading.position_rad.size(), axes);
  EXPECT_EQ(reading.velocity_rad_s.size(), axes);
  EXPECT_EQ(reading.acceleration_rad_s2.size(), axes);
  EXPECT_EQ(reading.torque_Nm.size(), axes);
  EXPECT_EQ((*board().limits()).size(), axes);
  EXPECT_EQ((*board().control_modes()).size(), axes);
  EXPECT_EQ((*board().target_positions()).size(), axes);
  EXPECT_EQ((*board().reference_speeds()).size(), axes);
  EXPECT_EQ((*board().motion_done()).size(), axes);
}

TEST_P(ControlBoardContract, LimitsAreInOrderAndJointsWithinThem) {
  const std::vector<JointLimits> limits = *board().limits();
  const std::vector<double> position_rad = board().read_joints()->position_rad;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    EXPECT_LT(limits[i].min_rad, limits[i].max_rad) << i;
    EXPECT_GT(limits[i].max_velocity_rad_s, 0) << i;
    EXPECT_GT(limits[i].max_torque_Nm, 0) << i;
    EXPECT_GE(position_rad[i], limits[i].min_rad - rig_->tolerance_rad()) << i;
    EXPECT_LE(position_rad[i], limits[i].max_rad + rig_->tolerance_rad()) << i;
  }
}

TEST_P(ControlBoardContract, TimeOfMeasurementGoesOn) {
  const std::int64_t first_ns = board().read_joints()->stamp_ns;
  pass(0.1);
  EXPECT_GE(board().read_joints()->stamp_ns - first_ns, 50'000'000);
}

TEST_P(ControlBoardContract, RefusesJointsThatDoNotExist) {
  const double value[] = {0.1};
  const int below[] = {-1};
  const int above[] = {board().axes()};
  expect_refused(below, value);
  expect_refused(above, value);
  EXPECT_FALSE(board().set_control_mode(above, ControlMode::kIdle).ok());
  EXPECT_FALSE(board().stop(below).ok());
}

TEST_P(ControlBoardContract, RefusesWrongSizesAndJointsNamedTwice) {
  const double values[] = {0.1, 0.2};
  expect_refused(joint_, values);
  const int twice[] = {joint_[0], joint_[0]};
  expect_refused(twice, values);
}

TEST_P(ControlBoardContract, RefusesValuesThatAreNotFinite) {
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
        -std::numeric_limits<double>::infinity()}) {
    const double values[] = {value};
    expect_refused(joint_, values);
  }
}

TEST_P(ControlBoardContract, RefusesSpeedsThatAreNotAboveZero) {
  for (const double speed : {0.0, -1.0}) {
    const double speeds[] = {speed};
    EXPECT_FALSE(board().set_reference_speeds(joint_, speeds).ok()) << speed;
  }
}

TEST_P(ControlBoardContract, AnEmptyListDoesNothing) {
  for (const auto& [name, command] : commands()) {
    const Status status = command({}, {});
    EXPECT_TRUE(status.ok() || status.error().code == ErrorCode::kUnsupported) << name;
  }
}

TEST_P(ControlBoardContract, MoveArrivesAndSaysSo) {
  go_to(place(0.4));
  const double speed[] = {0.4};
  const double target[] = {place(0.4) + 0.2};
  ASSERT_TRUE(board().set_reference_speeds(joint_, speed).ok());
  EXPECT_NEAR((*board().reference_speeds()).at(index()), 0.4, 1e-6);
  ASSERT_TRUE(board().move_to(joint_, target).ok());
  EXPECT_TRUE(eventually(0.5, [&] { return !(*board().motion_done()).at(index()); }));
  EXPECT_NEAR((*board().target_positions()).at(index()), target[0], 1e-6);
  EXPECT_TRUE(eventually(5.0, [&] { return (*board().motion_done()).at(index()); }));
  EXPECT_TRUE(eventually(1.0, [&] { return std::abs(position() - target[0]) < rig_->tolerance_rad(); }))
      << position();
  EXPECT_EQ(mode(), ControlMode::kPosition);
}

TEST_P(ControlBoardContract, ASlowerMotionTakesLonger) {
  std::vector<double> durations_s;
  for (const double speed_rad_s : {0.2, 0.8}) {
    go_to(place(0.4));
    const double speed[] = {speed_rad_s};
    const double target[] = {place(0.4) + 0.2};
    ASSERT_TRUE(board().set_reference_speeds(joint_, speed).ok());
    ASSERT_TRUE(board().move_to(joint_, target).ok());
    int periods = 0;
    while (std::abs(position() - target[0]) > 0.03 && periods < 1000) {
      rig_->advance();
      ++periods;
    }
    durations_s.push_back(periods * 0.01);
  }
  EXPECT_GT(durations_s[0], 2 * durations_s[1]);
}

TEST_P(ControlBoardContract, TargetsBeyondALimitAreClamped) {
  const double target[] = {limits_.max_rad + 10.0};
  const double fast[] = {1000.0};
  ASSERT_TRUE(board().set_reference_speeds(joint_, fast).ok());
  EXPECT_NEAR((*board().reference_speeds()).at(index()), limits_.max_velocity_rad_s, 1e-6);
  ASSERT_TRUE(board().move_to(joint_, target).ok());
  EXPECT_NEAR((*board().target_positions()).at(index()), limits_.max_rad, 1e-6);
  for (int period = 0; period < 200; ++period) {
    rig_->advance();
    ASSERT_LE(position(), limits_.max_rad + rig_->tolerance_rad());
  }
}

TEST_P(ControlBoardContract, DirectTargetsAreFollowed) {
  go_to(place(0.4));
  const double start_rad = place(0.4);
  for (int period = 0; period < 100; ++period) {
    const double target[] = {start_rad + 0.002 * period};
    ASSERT_TRUE(board().set_positions(joint_, target).ok());
    rig_->advance();
  }
  // how the joint stands comes a little after the command went, over a network
  EXPECT_TRUE(eventually(5.0, [&] { return mode() == ControlMode::kDirect; }));
  EXPECT_TRUE(eventually(5.0, [&] { return std::abs(position() - (start_rad + 0.2)) < 0.04; })) << position();
}

TEST_P(ControlBoardContract, ASpeedIsKept) {
  go_to(place(0.4));
  const double speed[] = {0.3};
  const auto command = [&] { return board().set_velocities(joint_, speed); };
  stream_until([&] { return std::abs(velocity() - 0.3) < 0.06; }, command);
  const JointReading before = *board().read_joints();
  stream(0.5, command);
  const JointReading after = *board().read_joints();
  const double duration_s = static_cast<double>(after.stamp_ns - before.stamp_ns) * 1e-9;
  EXPECT_GT(duration_s, 0.4);
  EXPECT_EQ(mode(), ControlMode::kVelocity);
  EXPECT_NEAR(after.position_rad.at(index()) - before.position_rad.at(index()), 0.3 * duration_s, 0.06);
  EXPECT_NEAR(velocity(), 0.3, 0.06);
}

TEST_P(ControlBoardContract, ATorquePushes) {
  go_to(place(0.4));
  const double before_rad = position();
  const double torque[] = {0.5 * limits_.max_torque_Nm};
  stream_until([&] { return position() > before_rad + 0.02; },
               [&] { return board().set_torques(joint_, torque); });
  EXPECT_EQ(mode(), ControlMode::kTorque);
  EXPECT_GT(position(), before_rad + 0.02);
  EXPECT_LE(position(), limits_.max_rad + rig_->tolerance_rad());
}

TEST_P(ControlBoardContract, ADutyCyclePushes) {
  go_to(place(0.6));
  const double before_rad = position();
  const double duty_cycle[] = {-0.5};
  stream_until([&] { return position() < before_rad - 0.02; },
               [&] { return board().set_duty_cycles(joint_, duty_cycle); });
  EXPECT_EQ(mode(), ControlMode::kPwm);
  EXPECT_LT(position(), before_rad - 0.02);
  EXPECT_GE(position(), limits_.min_rad - rig_->tolerance_rad());
}

TEST_P(ControlBoardContract, StopEndsAMotion) {
  go_to(place(0.3));
  const double speed[] = {0.3};
  const double target[] = {place(0.7)};
  ASSERT_TRUE(board().set_reference_speeds(joint_, speed).ok());
  ASSERT_TRUE(board().move_to(joint_, target).ok());
  ASSERT_TRUE(eventually(5.0, [&] { return position() > place(0.3) + 0.1; }));
  ASSERT_TRUE(board().stop(joint_).ok());
  ASSERT_TRUE(eventually(1.0, [&] { return std::abs(velocity()) < 0.02; }));
  const double stopped_rad = position();
  EXPECT_LT(stopped_rad, place(0.7) - 0.02);
  pass(0.5);
  EXPECT_NEAR(position(), stopped_rad, 0.02);
  EXPECT_EQ(mode(), ControlMode::kPosition);
}

TEST_P(ControlBoardContract, StopEndsASpeed) {
  if (!rig_->keeps_order()) GTEST_SKIP() << "streams and orders are not in order here";
  go_to(place(0.4));
  const double speed[] = {0.3};
  stream(0.3, [&] { return board().set_velocities(joint_, speed); });
  ASSERT_TRUE(board().stop(joint_).ok());
  EXPECT_TRUE(
      eventually(1.0, [&] { return std::abs(velocity()) < 0.02 && mode() == ControlMode::kPosition; }));
}

// what was streamed before an order does not undo it, and what is streamed after it counts
TEST_P(ControlBoardContract, AStreamedSpeedDoesNotOutliveAStop) {
  if (!rig_->keeps_order()) GTEST_SKIP() << "streams and orders are not in order here";
  go_to(place(0.4));
  const double before_rad = position();
  const double speed[] = {0.3};
  const double back[] = {-0.3};
  ASSERT_TRUE(board().set_velocities(joint_, speed).ok());
  ASSERT_TRUE(board().stop(joint_).ok());
  pass(0.2);
  EXPECT_EQ(mode(), ControlMode::kPosition);
  EXPECT_NEAR(position(), before_rad, 0.02);
  stream_until([&] { return position() < before_rad - 0.1; },
               [&] { return board().set_velocities(joint_, back); });
  EXPECT_EQ(mode(), ControlMode::kVelocity);
  EXPECT_LT(position(), before_rad - 0.1);
}

TEST_P(ControlBoardContract, ModesAreSetAndTold) {
  for (const ControlMode wanted : {ControlMode::kIdle, ControlMode::kVelocity, ControlMode::kPosition}) {
    ASSERT_TRUE(board().set_control_mode(joint_, wanted).ok());
    EXPECT_TRUE(eventually(0.5, [&] { return mode() == wanted; })) << to_string(wanted);
  }
  EXPECT_FALSE(board().set_control_mode(joint_, ControlMode::kFault).ok());
}

TEST_P(ControlBoardContract, AModeThatHoldsDoesNotMoveTheJoint) {
  go_to(place(0.5));
  for (const ControlMode wanted : {ControlMode::kDirect, ControlMode::kVelocity, ControlMode::kPosition}) {
    ASSERT_TRUE(board().set_control_mode(joint_, wanted).ok());
    pass(0.2);
    EXPECT_NEAR(position(), place(0.5), 0.03) << to_string(wanted);
  }
}

// -- what lies under the joints

TEST_P(ControlBoardContract, MotorsHaveAValueForEachJointOrNone) {
  const auto axes = static_cast<std::size_t>(board().axes());
  const Result<MotorReading> motors = board().read_motors();
  ASSERT_TRUE(motors.ok()) << motors.error().message;
  EXPECT_EQ(motors->position_rad.size(), axes);
  for (const auto* values : {&motors->velocity_rad_s, &motors->acceleration_rad_s2, &motors->duty_cycle,
                             &motors->current_A, &motors->temperature_C}) {
    EXPECT_TRUE(values->empty() || values->size() == axes);
    for (const double value : *values) EXPECT_TRUE(std::isfinite(value));
  }
}

TEST_P(ControlBoardContract, AMotorTurnsWithItsJoint) {
  go_to(place(0.3));
  const double before_rad = board().read_motors()->position_rad.at(index());
  go_to(place(0.6));
  EXPECT_NEAR(board().read_motors()->position_rad.at(index()) - before_rad, place(0.6) - place(0.3), 0.06);
}

TEST_P(ControlBoardContract, AmplifiersDriveUnlessTheJointIsIdle) {
  ASSERT_TRUE(board().set_control_mode(joint_, ControlMode::kIdle).ok());
  EXPECT_TRUE(eventually(0.5, [&] { return !board().amplifiers_on()->at(index()); }));
  ASSERT_TRUE(board().set_control_mode(joint_, ControlMode::kPosition).ok());
  EXPECT_TRUE(eventually(0.5, [&] { return bool(board().amplifiers_on()->at(index())); }));
}

TEST_P(ControlBoardContract, GainsArePutAndTold) {
  const std::vector<Pid> before = *board().pids(PidLoop::kPosition);
  ASSERT_EQ(before.size(), static_cast<std::size_t>(board().axes()));
  Pid softer[] = {before[index()]};
  softer[0].kp *= 0.5;
  ASSERT_GT(softer[0].kp, 0);
  ASSERT_TRUE(board().set_pids(PidLoop::kPosition, joint_, softer).ok());
  const std::vector<Pid> after = *board().pids(PidLoop::kPosition);
  for (std::size_t i = 0; i < after.size(); ++i) {
    EXPECT_NEAR(after[i].kp, i == index() ? softer[0].kp : before[i].kp, 1e-6) << i;
  }
  go_to(place(0.5));
}

TEST_P(ControlBoardContract, RefusesGainsThatMakeNoSense) {
  const std::vector<Pid> before = *board().pids(PidLoop::kPosition);
  const int above[] = {board().axes()};
  const Pid good[] = {before[index()]};
  EXPECT_FALSE(board().set_pids(PidLoop::kPosition, above, good).ok());
  EXPECT_FALSE(board().set_pids(PidLoop::kPosition, joint_, {}).ok());
  for (const double kp : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    Pid bad[] = {before[index()]};
    bad[0].kp = kp;
    EXPECT_FALSE(board().set_pids(PidLoop::kPosition, joint_, bad).ok()) << kp;
  }
  EXPECT_NEAR(board().pids(PidLoop::kPosition)->at(index()).kp, before[index()].kp, 1e-6);
}

TEST_P(ControlBoardContract, ALoopTellsWhatItWants) {
  go_to(place(0.5));
  const Result<PidReading> loop = board().read_pids(PidLoop::kPosition);
  ASSERT_TRUE(loop.ok()) << loop.error().message;
  const auto axes = static_cast<std::size_t>(board().axes());
  ASSERT_EQ(loop->reference.size(), axes);
  ASSERT_EQ(loop->error.size(), axes);
  ASSERT_EQ(loop->output.size(), axes);
  EXPECT_NEAR(loop->reference.at(index()), place(0.5), 0.02);
  EXPECT_NEAR(loop->error.at(index()), 0, 0.02);
}

TEST_P(ControlBoardContract, InteractionIsToldAsItWasSetOrRefused) {
  ASSERT_TRUE(board().set_interaction_mode(joint_, InteractionMode::kStiff).ok());
  EXPECT_EQ(board().interaction_modes()->at(index()), InteractionMode::kStiff);
  const bool can = board().set_interaction_mode(joint_, InteractionMode::kCompliant).ok();
  EXPECT_EQ(board().interaction_modes()->at(index()) == InteractionMode::kCompliant, can);
  const int above[] = {board().axes()};
  EXPECT_FALSE(board().set_interaction_mode(above, InteractionMode::kStiff).ok());
  const Impedance spring[] = {{2.0, 0.1, 0.5}};
  if (board().set_impedances(joint_, spring).ok()) {
    const Impedance told = board().impedances()->at(index());
    EXPECT_NEAR(told.stiffness_Nm_rad, 2.0, 1e-6);
    EXPECT_NEAR(told.damping_Nms_rad, 0.1, 1e-6);
    EXPECT_NEAR(told.offset_Nm, 0.5, 1e-6);
  } else {
    EXPECT_FALSE(can) << "a joint that can comply has an impedance";
  }
  const Impedance impossible[] = {{-1.0, 0.1, 0.0}};
  EXPECT_FALSE(board().set_impedances(joint_, impossible).ok());
}

TEST_P(ControlBoardContract, HomeIsAPlaceOfItsOwn) {
  std::vector<double> homes_rad;
  const double fast[] = {limits_.max_velocity_rad_s};
  for (const double from : {0.3, 0.7}) {
    go_to(place(from));
    ASSERT_TRUE(board().set_reference_speeds(joint_, fast).ok());
    ASSERT_TRUE(board().home(joint_).ok());
    EXPECT_TRUE(eventually(0.5, [&] { return mode() == ControlMode::kPosition; }));
    const double home_rad = board().target_positions()->at(index());
    EXPECT_TRUE(eventually(10.0, [&] { return std::abs(position() - home_rad) < rig_->tolerance_rad(); }));
    homes_rad.push_back(home_rad);
  }
  EXPECT_NEAR(homes_rad[0], homes_rad[1], 1e-6);
  EXPECT_TRUE(board().calibrate(joint_).ok());
  EXPECT_TRUE(board().calibrated()->at(index()));
  const int above[] = {board().axes()};
  EXPECT_FALSE(board().home(above).ok());
  EXPECT_FALSE(board().calibrate(above).ok());
}

TEST_P(ControlBoardContract, VariablesAreThoseOfTheList) {
  const Result<std::vector<std::string>> names = board().variable_names();
  ASSERT_TRUE(names.ok()) << names.error().message;
  for (const std::string& name : *names) {
    const std::string value = "a \"b\" 3";
    if (board().set_variable(name, value).ok()) {
      EXPECT_EQ(*board().variable(name), value) << name;
    } else {
      EXPECT_TRUE(board().variable(name).ok()) << name;
    }
  }
  EXPECT_FALSE(board().variable("no such thing").ok());
  EXPECT_FALSE(board().set_variable("no such thing", "1").ok());
}

}  // namespace nido::test
