#include "fake/fake_control_board.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "nido/interfaces/check_joints.h"

namespace nido {
namespace {

constexpr double kDefaultAcceleration_rad_s2 = 20.0;
// shape of a minimum-jerk motion over unit distance and time: greatest speed and acceleration
constexpr double kPeakSpeed = 15.0 / 8.0;
constexpr double kPeakAcceleration = 5.7735026918962573;  // 10 / sqrt(3)

double minimum_jerk(double s) { return s * s * s * (10 + s * (-15 + 6 * s)); }

std::size_t at(int joint) { return static_cast<std::size_t>(joint); }

}  // namespace

FakeControlBoard::FakeControlBoard(std::vector<FakeJoint> joints, std::int64_t start_ns) : now_ns_(start_ns) {
  for (FakeJoint& fixed : joints) {
    Joint joint;
    joint.fixed = std::move(fixed);
    joint.position_rad =
        std::clamp(joint.fixed.start_rad, joint.fixed.limits.min_rad, joint.fixed.limits.max_rad);
    joint.command = joint.position_rad;
    joint.reference_speed_rad_s =
        std::min(joint.fixed.reference_speed_rad_s, joint.fixed.limits.max_velocity_rad_s);
    joint.reference_acceleration_rad_s2 = kDefaultAcceleration_rad_s2;
    joint.pids.fill(Pid{.kp = 10, .max_output = 1, .scale = 1});
    joints_.push_back(std::move(joint));
  }
}

void FakeControlBoard::set_failures(FakeFailures failures) {
  const std::lock_guard lock(mutex_);
  failures_ = std::move(failures);
}

void FakeControlBoard::schedule_failures(std::int64_t at_ns, FakeFailures failures) {
  const std::lock_guard lock(mutex_);
  failures_at_ns_ = at_ns;
  scheduled_ = std::move(failures);
}

void FakeControlBoard::set_fault(int joint, bool broken) {
  const std::lock_guard lock(mutex_);
  begin(joints_.at(at(joint)), broken ? ControlMode::kFault : ControlMode::kIdle, 0);
}

Status FakeControlBoard::step_to(std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  if (scheduled_ && now_ns >= failures_at_ns_) failures_ = *std::exchange(scheduled_, std::nullopt);
  if (failures_.step) return *failures_.step;
  const double dt_s = static_cast<double>(now_ns - now_ns_) * 1e-9;
  if (dt_s <= 0) return {};
  for (Joint& joint : joints_) advance(joint, dt_s);
  now_ns_ = now_ns;
  return {};
}

void FakeControlBoard::advance(Joint& joint, double dt_s) {
  const JointLimits& limits = joint.fixed.limits;
  const double old_position_rad = joint.position_rad;
  const double old_velocity_rad_s = joint.velocity_rad_s;
  double next_rad = old_position_rad;
  switch (joint.mode) {
    case ControlMode::kPosition: {
      joint.elapsed_s = std::min(joint.elapsed_s + dt_s, joint.duration_s);
      const double s = joint.duration_s > 0 ? joint.elapsed_s / joint.duration_s : 1.0;
      next_rad =
          s >= 1.0 ? joint.command : joint.from_rad + (joint.command - joint.from_rad) * minimum_jerk(s);
      break;
    }
    case ControlMode::kDirect: {
      const double reach_rad = limits.max_velocity_rad_s * dt_s;
      next_rad += std::clamp(joint.command - next_rad, -reach_rad, reach_rad);
      break;
    }
    case ControlMode::kVelocity:
      next_rad += joint.command * dt_s;
      break;
    case ControlMode::kTorque:
      if (limits.max_torque_Nm > 0) {
        next_rad += joint.command / limits.max_torque_Nm * limits.max_velocity_rad_s * dt_s;
      }
      break;
    case ControlMode::kPwm:
      next_rad += joint.command * limits.max_velocity_rad_s * dt_s;
      break;
    case ControlMode::kIdle:
    case ControlMode::kFault:
      break;
  }
  joint.position_rad = std::clamp(next_rad, limits.min_rad, limits.max_rad);
  joint.velocity_rad_s = (joint.position_rad - old_position_rad) / dt_s;
  joint.acceleration_rad_s2 = (joint.velocity_rad_s - old_velocity_rad_s) / dt_s;
  joint.torque_Nm = joint.mode == ControlMode::kTorque ? joint.command
                    : joint.mode == ControlMode::kPwm  ? joint.command * limits.max_torque_Nm
                                                       : 0.0;
}

void FakeControlBoard::begin(Joint& joint, ControlMode mode, double value) {
  const JointLimits& limits = joint.fixed.limits;
  joint.mode = mode;
  switch (mode) {
    case ControlMode::kPosition: {
      joint.command = std::clamp(value, limits.min_rad, limits.max_rad);
      joint.from_rad = joint.position_rad;
      joint.elapsed_s = 0;
      const double distance_rad = std::abs(joint.command - joint.from_rad);
      joint.duration_s =
          std::max(kPeakSpeed * distance_rad / joint.reference_speed_rad_s,
                   std::sqrt(kPeakAcceleration * distance_rad / joint.reference_acceleration_rad_s2));
      break;
    }
    case ControlMode::kDirect:
      joint.command = std::clamp(value, limits.min_rad, limits.max_rad);
      break;
    case ControlMode::kVelocity:
      joint.command = std::clamp(value, -limits.max_velocity_rad_s, limits.max_velocity_rad_s);
      break;
    case ControlMode::kTorque:
      joint.command = std::clamp(value, -limits.max_torque_Nm, limits.max_torque_Nm);
      break;
    case ControlMode::kPwm:
      joint.command = std::clamp(value, -1.0, 1.0);
      break;
    case ControlMode::kIdle:
    case ControlMode::kFault:
      joint.command = 0;
      break;
  }
}

Status FakeControlBoard::check_commandable(std::span<const int> joints) const {
  if (failures_.commands) return *failures_.commands;
  for (const int joint : joints) {
    if (joints_[at(joint)].mode == ControlMode::kFault) {
      return Error{ErrorCode::kFailed, "joint " + std::to_string(joint) + " (" +
                                           joints_[at(joint)].fixed.name +
                                           ") has a hardware fault and takes no command"};
    }
  }
  return {};
}

Status FakeControlBoard::command(ControlMode mode, std::span<const int> joints,
                                 std::span<const double> values) {
  const std::lock_guard lock(mutex_);
  if (Status valid = check_joint_values(axes(), joints, values); !valid) return valid;
  if (Status able = check_commandable(joints); !able) return able;
  for (std::size_t i = 0; i < joints.size(); ++i) begin(joints_[at(joints[i])], mode, values[i]);
  return {};
}

int FakeControlBoard::axes() const { return static_cast<int>(joints_.size()); }

Result<std::string> FakeControlBoard::axis_name(int joint) const {
  const int wanted[] = {joint};
  if (Status valid = check_joints(axes(), wanted); !valid) return valid.error();
  return joints_[at(joint)].fixed.name;
}

Result<JointReading> FakeControlBoard::read_joints() const {
  const std::lock_guard lock(mutex_);
  if (failures_.reads) return *failures_.reads;
  JointReading reading;
  reading.stamp_ns = now_ns_;
  for (const Joint& joint : joints_) {
    reading.position_rad.push_back(joint.position_rad);
    reading.velocity_rad_s.push_back(joint.velocity_rad_s);
    reading.acceleration_rad_s2.push_back(joint.acceleration_rad_s2);
    reading.torque_Nm.push_back(joint.torque_Nm);
  }
  return reading;
}

Result<std::vector<JointLimits>> FakeControlBoard::limits() const {
  std::vector<JointLimits> all;
  for (const Joint& joint : joints_) all.push_back(joint.fixed.limits);
  return all;
}

Result<std::vector<ControlMode>> FakeControlBoard::control_modes() const {
  const std::lock_guard lock(mutex_);
  if (failures_.reads) return *failures_.reads;
  std::vector<ControlMode> modes;
  for (const Joint& joint : joints_) modes.push_back(joint.mode);
  return modes;
}

Status FakeControlBoard::set_control_mode(std::span<const int> joints, ControlMode mode) {
  const std::lock_guard lock(mutex_);
  if (mode == ControlMode::kFault) {
    return Error{ErrorCode::kInvalidArgument, "mode fault cannot be asked for"};
  }
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  if (Status able = check_commandable(joints); !able) return able;
  const bool holds = mode == ControlMode::kPosition || mode == ControlMode::kDirect;
  for (const int joint : joints)
    begin(joints_[at(joint)], mode, holds ? joints_[at(joint)].position_rad : 0.0);
  return {};
}

Status FakeControlBoard::move_to(std::span<const int> joints, std::span<const double> target_rad) {
  return command(ControlMode::kPosition, joints, target_rad);
}

Result<std::vector<double>> FakeControlBoard::target_positions() const {
  const std::lock_guard lock(mutex_);
  if (failures_.reads) return *failures_.reads;
  std::vector<double> targets;
  for (const Joint& joint : joints_) {
    targets.push_back(joint.mode == ControlMode::kPosition ? joint.command : joint.position_rad);
  }
  return targets;
}

Status FakeControlBoard::set_reference_speeds(std::span<const int> joints,
                                              std::span<const double> speed_rad_s) {
  const std::lock_guard lock(mutex_);
  if (Status valid = check_joint_magnitudes(axes(), joints, speed_rad_s); !valid) return valid;
  if (failures_.commands) return *failures_.commands;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    Joint& joint = joints_[at(joints[i])];
    joint.reference_speed_rad_s = std::min(speed_rad_s[i], joint.fixed.limits.max_velocity_rad_s);
  }
  return {};
}

Result<std::vector<double>> FakeControlBoard::reference_speeds() const {
  const std::lock_guard lock(mutex_);
  std::vector<double> speeds;
  for (const Joint& joint : joints_) speeds.push_back(joint.reference_speed_rad_s);
  return speeds;
}

Status FakeControlBoard::set_reference_accelerations(std::span<const int> joints,
                                                     std::span<const double> acceleration_rad_s2) {
  const std::lock_guard lock(mutex_);
  if (Status valid = check_joint_magnitudes(axes(), joints, acceleration_rad_s2); !valid) return valid;
  if (failures_.commands) return *failures_.commands;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    joints_[at(joints[i])].reference_acceleration_rad_s2 = acceleration_rad_s2[i];
  }
  return {};
}

Result<std::vector<double>> FakeControlBoard::reference_accelerations() const {
  const std::lock_guard lock(mutex_);
  std::vector<double> accelerations;
  for (const Joint& joint : joints_) accelerations.push_back(joint.reference_acceleration_rad_s2);
  return accelerations;
}

Result<std::vector<bool>> FakeControlBoard::motion_done() const {
  const std::lock_guard lock(mutex_);
  if (failures_.reads) return *failures_.reads;
  std::vector<bool> done;
  for (const Joint& joint : joints_) {
    done.push_back(joint.mode != ControlMode::kPosition || joint.elapsed_s >= joint.duration_s);
  }
  return done;
}

Status FakeControlBoard::stop(std::span<const int> joints) {
  const std::lock_guard lock(mutex_);
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  if (Status able = check_commandable(joints); !able) return able;
  for (const int joint : joints)
    begin(joints_[at(joint)], ControlMode::kPosition, joints_[at(joint)].position_rad);
  return {};
}

Status FakeControlBoard::set_positions(std::span<const int> joints, std::span<const double> target_rad) {
  return command(ControlMode::kDirect, joints, target_rad);
}
Status FakeControlBoard::set_velocities(std::span<const int> joints, std::span<const double> velocity_rad_s) {
  return command(ControlMode::kVelocity, joints, velocity_rad_s);
}
Status FakeControlBoard::set_torques(std::span<const int> joints, std::span<const double> torque_Nm) {
  return command(ControlMode::kTorque, joints, torque_Nm);
}
Status FakeControlBoard::set_duty_cycles(std::span<const int> joints, std::span<const double> duty_cycle) {
  return command(ControlMode::kPwm, joints, duty_cycle);
}

}  // namespace nido
