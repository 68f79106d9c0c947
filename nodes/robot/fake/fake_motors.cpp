// What lies under the joints of a fake board.

#include <algorithm>

#include "fake/fake_control_board.h"
#include "nido/interfaces/check_motors.h"

namespace nido {
namespace {

constexpr double kFullCurrent_A = 2.0;
constexpr double kTemperature_C = 25.0;
constexpr const char* kVariable = "note";
constexpr std::size_t kLongestNote = 200;

std::size_t at(int joint) { return static_cast<std::size_t>(joint); }
std::size_t at(PidLoop loop) { return static_cast<std::size_t>(loop); }

}  // namespace

Result<MotorReading> FakeControlBoard::read_motors() const {
  const std::lock_guard lock(mutex_);
  if (failures_.reads) return *failures_.reads;
  MotorReading reading;
  reading.stamp_ns = now_ns_;
  for (const Joint& joint : joints_) {
    reading.position_rad.push_back(joint.position_rad);
    reading.velocity_rad_s.push_back(joint.velocity_rad_s);
    reading.acceleration_rad_s2.push_back(joint.acceleration_rad_s2);
    const double full_Nm = joint.fixed.limits.max_torque_Nm;
    reading.duty_cycle.push_back(full_Nm > 0 ? joint.torque_Nm / full_Nm : 0.0);
    reading.current_A.push_back(reading.duty_cycle.back() * kFullCurrent_A);
    reading.temperature_C.push_back(kTemperature_C);
  }
  return reading;
}

Result<std::vector<bool>> FakeControlBoard::amplifiers_on() const {
  const std::lock_guard lock(mutex_);
  if (failures_.reads) return *failures_.reads;
  std::vector<bool> on;
  for (const Joint& joint : joints_) {
    on.push_back(joint.mode != ControlMode::kIdle && joint.mode != ControlMode::kFault);
  }
  return on;
}

Result<std::vector<Pid>> FakeControlBoard::pids(PidLoop loop) const {
  const std::lock_guard lock(mutex_);
  std::vector<Pid> all;
  for (const Joint& joint : joints_) all.push_back(joint.pids[at(loop)]);
  return all;
}

Status FakeControlBoard::set_pids(PidLoop loop, std::span<const int> joints, std::span<const Pid> pids) {
  const std::lock_guard lock(mutex_);
  if (Status valid = check_pids(axes(), joints, pids); !valid) return valid;
  if (failures_.commands) return *failures_.commands;
  for (std::size_t i = 0; i < joints.size(); ++i) joints_[at(joints[i])].pids[at(loop)] = pids[i];
  return {};
}

Result<PidReading> FakeControlBoard::read_pids(PidLoop loop) const {
  const std::lock_guard lock(mutex_);
  if (failures_.reads) return *failures_.reads;
  PidReading reading;
  for (const Joint& joint : joints_) {
    // whatever is wanted is there at once
    double wanted = joint.position_rad;
    if (loop == PidLoop::kVelocity) wanted = joint.velocity_rad_s;
    if (loop == PidLoop::kTorque) wanted = joint.torque_Nm;
    if (loop == PidLoop::kCurrent) wanted = 0;
    reading.reference.push_back(wanted);
    reading.error.push_back(0);
    reading.output.push_back(0);
  }
  return reading;
}

Result<std::vector<InteractionMode>> FakeControlBoard::interaction_modes() const {
  const std::lock_guard lock(mutex_);
  std::vector<InteractionMode> modes;
  for (const Joint& joint : joints_) modes.push_back(joint.interaction);
  return modes;
}

Status FakeControlBoard::set_interaction_mode(std::span<const int> joints, InteractionMode mode) {
  const std::lock_guard lock(mutex_);
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  if (Status able = check_commandable(joints); !able) return able;
  for (const int joint : joints) joints_[at(joint)].interaction = mode;
  return {};
}

Result<std::vector<Impedance>> FakeControlBoard::impedances() const {
  const std::lock_guard lock(mutex_);
  std::vector<Impedance> all;
  for (const Joint& joint : joints_) all.push_back(joint.impedance);
  return all;
}

Status FakeControlBoard::set_impedances(std::span<const int> joints, std::span<const Impedance> impedances) {
  const std::lock_guard lock(mutex_);
  if (Status valid = check_impedances(axes(), joints, impedances); !valid) return valid;
  if (failures_.commands) return *failures_.commands;
  for (std::size_t i = 0; i < joints.size(); ++i) joints_[at(joints[i])].impedance = impedances[i];
  return {};
}

Status FakeControlBoard::calibrate(std::span<const int> joints) {
  const std::lock_guard lock(mutex_);
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  if (Status able = check_commandable(joints); !able) return able;
  for (const int joint : joints) joints_[at(joint)].calibrated = true;
  return {};
}

Result<std::vector<bool>> FakeControlBoard::calibrated() const {
  const std::lock_guard lock(mutex_);
  if (failures_.reads) return *failures_.reads;
  std::vector<bool> all;
  for (const Joint& joint : joints_) all.push_back(joint.calibrated);
  return all;
}

Status FakeControlBoard::home(std::span<const int> joints) {
  const std::lock_guard lock(mutex_);
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  if (Status able = check_commandable(joints); !able) return able;
  for (const int joint : joints) {
    begin(joints_[at(joint)], ControlMode::kPosition, joints_[at(joint)].fixed.start_rad);
  }
  return {};
}

Result<std::vector<std::string>> FakeControlBoard::variable_names() const {
  return std::vector<std::string>{kVariable};
}

Result<std::string> FakeControlBoard::variable(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  if (name != kVariable) {
    return Error{ErrorCode::kNotFound, "there is no variable '" + name.substr(0, 40) + "': there is note"};
  }
  return note_;
}

Status FakeControlBoard::set_variable(const std::string& name, const std::string& value) {
  const std::lock_guard lock(mutex_);
  if (name != kVariable) {
    return Error{ErrorCode::kNotFound, "there is no variable '" + name.substr(0, 40) + "': there is note"};
  }
  if (value.size() > kLongestNote) {
    return Error{ErrorCode::kInvalidArgument, "a note has at most 200 characters"};
  }
  note_ = value;
  return {};
}

}  // namespace nido
