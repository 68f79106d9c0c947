#include "nido/simulator/devices/simulated_control_board.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "nido/interfaces/check_joints.h"

namespace nido::sim {
namespace {

ControlMode to_control_mode(JointMode mode) {
  switch (mode) {
    case JointMode::kIdle:
      return ControlMode::kIdle;
    case JointMode::kPosition:
      return ControlMode::kPosition;
    case JointMode::kDirect:
      return ControlMode::kDirect;
    case JointMode::kVelocity:
      return ControlMode::kVelocity;
    case JointMode::kTorque:
      return ControlMode::kTorque;
    case JointMode::kPwm:
      return ControlMode::kPwm;
  }
  return ControlMode::kFault;
}

JointMode to_joint_mode(ControlMode mode) {
  switch (mode) {
    case ControlMode::kPosition:
      return JointMode::kPosition;
    case ControlMode::kDirect:
      return JointMode::kDirect;
    case ControlMode::kVelocity:
      return JointMode::kVelocity;
    case ControlMode::kTorque:
      return JointMode::kTorque;
    case ControlMode::kPwm:
      return JointMode::kPwm;
    case ControlMode::kIdle:
    case ControlMode::kFault:
      break;
  }
  return JointMode::kIdle;
}

Error accelerations_unsupported() {
  return Error{ErrorCode::kUnsupported,
               "the simulated drives make minimum-jerk motions from the reference speed alone: accelerations "
               "cannot be set"};
}

}  // namespace

Result<std::unique_ptr<SimulatedControlBoard>> SimulatedControlBoard::create(
    std::shared_ptr<SimulatedRobot> robot, std::string_view part) {
  const int index = robot->simulation().part_index(part);
  if (index < 0) {
    std::string known;
    for (const PartInfo& info : robot->simulation().parts()) known += (known.empty() ? "" : ", ") + info.name;
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the simulated robot has no part '{}': there are {}", part, known)};
  }
  return std::unique_ptr<SimulatedControlBoard>(new SimulatedControlBoard(std::move(robot), index));
}

SimulatedControlBoard::SimulatedControlBoard(std::shared_ptr<SimulatedRobot> robot, int part)
    : robot_(std::move(robot)),
      part_(part),
      joints_(robot_->simulation().parts()[static_cast<std::size_t>(part)].joints) {}

int SimulatedControlBoard::axes() const { return static_cast<int>(joints_.size()); }

Result<std::string> SimulatedControlBoard::axis_name(int joint) const {
  const int wanted[] = {joint};
  if (Status valid = check_joints(axes(), wanted); !valid) return valid.error();
  return joints_[static_cast<std::size_t>(joint)].name;
}

Result<JointReading> SimulatedControlBoard::read_joints() const {
  const std::lock_guard lock(robot_->mutex());
  JointReading reading;
  reading.stamp_ns = robot_->now_ns();
  for (const JointState& state : robot_->simulation().joints(part_)) {
    reading.position_rad.push_back(state.position_rad);
    reading.velocity_rad_s.push_back(state.velocity_rad_s);
    reading.torque_Nm.push_back(state.torque_Nm);
  }
  reading.acceleration_rad_s2.assign(joints_.size(), 0.0);
  return reading;
}

Result<std::vector<JointLimits>> SimulatedControlBoard::limits() const {
  std::vector<JointLimits> limits;
  for (const JointInfo& info : joints_) {
    limits.push_back({info.min_rad, info.max_rad, info.max_velocity_rad_s, info.max_torque_Nm});
  }
  return limits;
}

Result<std::vector<ControlMode>> SimulatedControlBoard::control_modes() const {
  const std::lock_guard lock(robot_->mutex());
  std::vector<ControlMode> modes;
  for (const JointState& state : robot_->simulation().joints(part_))
    modes.push_back(to_control_mode(state.mode));
  return modes;
}

Status SimulatedControlBoard::command(JointMode mode, std::span<const int> joints,
                                      std::span<const double> values) {
  if (Status valid = check_joint_values(axes(), joints, values); !valid) return valid;
  if (joints.empty()) return {};
  const std::lock_guard lock(robot_->mutex());
  return robot_->simulation().command(part_, mode, joints, values);
}

Status SimulatedControlBoard::set_control_mode(std::span<const int> joints, ControlMode mode) {
  if (mode == ControlMode::kFault)
    return Error{ErrorCode::kInvalidArgument, "mode fault cannot be asked for"};
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  if (joints.empty()) return {};
  const std::lock_guard lock(robot_->mutex());
  const std::span<const JointState> states = robot_->simulation().joints(part_);
  const bool holds = mode == ControlMode::kPosition || mode == ControlMode::kDirect;
  std::vector<double> values;
  for (const int joint : joints)
    values.push_back(holds ? states[static_cast<std::size_t>(joint)].position_rad : 0.0);
  return robot_->simulation().command(part_, to_joint_mode(mode), joints, values);
}

Status SimulatedControlBoard::move_to(std::span<const int> joints, std::span<const double> target_rad) {
  return command(JointMode::kPosition, joints, target_rad);
}

Result<std::vector<double>> SimulatedControlBoard::target_positions() const {
  const std::lock_guard lock(robot_->mutex());
  std::vector<double> targets;
  for (const JointState& state : robot_->simulation().joints(part_)) {
    targets.push_back(state.mode == JointMode::kPosition ? state.target : state.position_rad);
  }
  return targets;
}

Status SimulatedControlBoard::set_reference_speeds(std::span<const int> joints,
                                                   std::span<const double> speed_rad_s) {
  if (Status valid = check_joint_magnitudes(axes(), joints, speed_rad_s); !valid) return valid;
  const std::lock_guard lock(robot_->mutex());
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (Status set = robot_->simulation().set_reference_speed(part_, joints[i], speed_rad_s[i]); !set)
      return set;
  }
  return {};
}

Result<std::vector<double>> SimulatedControlBoard::reference_speeds() const {
  const std::lock_guard lock(robot_->mutex());
  std::vector<double> speeds;
  for (const JointState& state : robot_->simulation().joints(part_))
    speeds.push_back(state.reference_speed_rad_s);
  return speeds;
}

Status SimulatedControlBoard::set_reference_accelerations(std::span<const int> joints,
                                                          std::span<const double> acceleration_rad_s2) {
  if (Status valid = check_joint_magnitudes(axes(), joints, acceleration_rad_s2); !valid) return valid;
  return joints.empty() ? Status() : Status(accelerations_unsupported());
}

Result<std::vector<double>> SimulatedControlBoard::reference_accelerations() const {
  return accelerations_unsupported();
}

Result<std::vector<bool>> SimulatedControlBoard::motion_done() const {
  const std::lock_guard lock(robot_->mutex());
  std::vector<bool> done;
  for (const JointState& state : robot_->simulation().joints(part_)) {
    done.push_back(state.mode != JointMode::kPosition || state.motion_done);
  }
  return done;
}

Status SimulatedControlBoard::stop(std::span<const int> joints) {
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  const std::lock_guard lock(robot_->mutex());
  for (const int joint : joints) {
    if (Status stopped = robot_->simulation().stop(part_, joint); !stopped) return stopped;
  }
  return {};
}

Status SimulatedControlBoard::set_positions(std::span<const int> joints, std::span<const double> target_rad) {
  return command(JointMode::kDirect, joints, target_rad);
}
Status SimulatedControlBoard::set_velocities(std::span<const int> joints,
                                             std::span<const double> velocity_rad_s) {
  return command(JointMode::kVelocity, joints, velocity_rad_s);
}
Status SimulatedControlBoard::set_torques(std::span<const int> joints, std::span<const double> torque_Nm) {
  return command(JointMode::kTorque, joints, torque_Nm);
}
Status SimulatedControlBoard::set_duty_cycles(std::span<const int> joints,
                                              std::span<const double> duty_cycle) {
  return command(JointMode::kPwm, joints, duty_cycle);
}

}  // namespace nido::sim
