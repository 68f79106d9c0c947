// What lies under the joints of a simulated board.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <mutex>
#include <string_view>

#include "nido/interfaces/check_motors.h"
#include "nido/simulator/devices/simulated_control_board.h"

namespace nido::sim {
namespace {

Pid position_gains(const JointState& state) {
  return Pid{.kp = state.servo_gain_1_s, .max_output = 1, .scale = 1};
}

Error no_loop(PidLoop loop) {
  return Error{ErrorCode::kUnsupported,
               fmt::format("the simulated drives have no loop '{}' with gains: there is pos", to_word(loop))};
}

double share(double torque_Nm, double most_Nm) { return most_Nm > 0 ? torque_Nm / most_Nm : 0.0; }

// current at the greatest torque, of every motor
constexpr double kGreatestCurrent_A = 3.0;

// Joints turn as their motors do, so couplings and gears are 1; there is no encoder of a rotor, no sensor of
// hall or temperature, and no loop of current.
constexpr std::string_view kCouplings = "kinematic_mj";
struct Variable {
  std::string_view name;
  std::string_view of_each_joint;
};
constexpr auto kVariables = std::to_array<Variable>({{"rotor", "0.0"},
                                                     {"gearbox", "1.0"},
                                                     {"zeros", "0.0"},
                                                     {"hasHallSensor", "0"},
                                                     {"hasTempSensor", "0"},
                                                     {"hasRotorEncoder", "0"},
                                                     {"rotorIndexOffset", "0"},
                                                     {"motorPoles", "0"},
                                                     {"pidCurrentKp", "0.0"},
                                                     {"pidCurrentKi", "0.0"},
                                                     {"pidCurrentShift", "0.0"}});

Error no_variable(const std::string& name) {
  return Error{ErrorCode::kNotFound, fmt::format("there is no variable '{}'", name.substr(0, 40))};
}

}  // namespace

Result<MotorReading> SimulatedControlBoard::read_motors() const {
  const std::lock_guard lock(robot_->mutex());
  const std::span<const JointState> states = robot_->simulation().joints(part_);
  MotorReading reading;
  reading.stamp_ns = robot_->now_ns();
  for (std::size_t i = 0; i < states.size(); ++i) {
    reading.position_rad.push_back(states[i].position_rad);
    reading.velocity_rad_s.push_back(states[i].velocity_rad_s);
    reading.duty_cycle.push_back(share(states[i].torque_Nm, joints_[i].max_torque_Nm));
    reading.current_A.push_back(reading.duty_cycle.back() * kGreatestCurrent_A);
  }
  reading.acceleration_rad_s2.assign(states.size(), 0.0);  // as of the joints: not measured
  return reading;
}

Result<std::vector<double>> SimulatedControlBoard::greatest_currents() const {
  return std::vector<double>(joints_.size(), kGreatestCurrent_A);
}

Result<std::vector<bool>> SimulatedControlBoard::amplifiers_on() const {
  const std::lock_guard lock(robot_->mutex());
  std::vector<bool> on;
  for (const JointState& state : robot_->simulation().joints(part_)) {
    on.push_back(state.mode != JointMode::kIdle);
  }
  return on;
}

Result<std::vector<Pid>> SimulatedControlBoard::pids(PidLoop loop) const {
  if (loop != PidLoop::kPosition) return std::vector<Pid>(joints_.size());
  const std::lock_guard lock(robot_->mutex());
  std::vector<Pid> gains;
  for (const JointState& state : robot_->simulation().joints(part_)) gains.push_back(position_gains(state));
  return gains;
}

Status SimulatedControlBoard::set_pids(PidLoop loop, std::span<const int> joints, std::span<const Pid> pids) {
  if (Status valid = check_pids(axes(), joints, pids); !valid) return valid;
  if (loop != PidLoop::kPosition) return joints.empty() ? Status() : Status(no_loop(loop));
  const std::lock_guard lock(robot_->mutex());
  const std::span<const JointState> states = robot_->simulation().joints(part_);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    Pid possible = position_gains(states[static_cast<std::size_t>(joints[i])]);
    possible.kp = pids[i].kp;
    if (!(possible == pids[i]) || !(pids[i].kp >= 1 && pids[i].kp <= 100)) {
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("the simulated servo of {} is its kp, 1 to 100 1/s: all other gains are 0, "
                               "greatest output and scale 1",
                               joints_[static_cast<std::size_t>(joints[i])].name)};
    }
  }
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (Status set = robot_->simulation().set_servo_gain(part_, joints[i], pids[i].kp); !set) return set;
  }
  return {};
}

Result<PidReading> SimulatedControlBoard::read_pids(PidLoop loop) const {
  const std::lock_guard lock(robot_->mutex());
  const std::span<const JointState> states = robot_->simulation().joints(part_);
  PidReading reading;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double output = share(states[i].torque_Nm, joints_[i].max_torque_Nm);
    const double measured = loop == PidLoop::kPosition   ? states[i].position_rad
                            : loop == PidLoop::kVelocity ? states[i].velocity_rad_s
                            : loop == PidLoop::kTorque   ? states[i].torque_Nm
                                                         : output * kGreatestCurrent_A;
    reading.reference.push_back(loop == PidLoop::kPosition ? states[i].reference_rad : measured);
    reading.error.push_back(reading.reference.back() - measured);
    reading.output.push_back(output);
  }
  return reading;
}

Result<std::vector<InteractionMode>> SimulatedControlBoard::interaction_modes() const {
  return std::vector<InteractionMode>(joints_.size(), InteractionMode::kStiff);
}

Status SimulatedControlBoard::set_interaction_mode(std::span<const int> joints, InteractionMode mode) {
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  if (mode == InteractionMode::kStiff || joints.empty()) return {};
  return Error{ErrorCode::kUnsupported, "the simulated joints are stiff (stif), they cannot comply"};
}

Result<std::vector<Impedance>> SimulatedControlBoard::impedances() const {
  return Error{ErrorCode::kUnsupported, "the simulated joints are stiff: they have no impedance"};
}

Status SimulatedControlBoard::set_impedances(std::span<const int> joints,
                                             std::span<const Impedance> impedances) {
  if (Status valid = check_impedances(axes(), joints, impedances); !valid) return valid;
  if (joints.empty()) return {};
  return Error{ErrorCode::kUnsupported, "the simulated joints are stiff: they have no impedance"};
}

Status SimulatedControlBoard::calibrate(std::span<const int> joints) { return check_joints(axes(), joints); }

Result<std::vector<bool>> SimulatedControlBoard::calibrated() const {
  return std::vector<bool>(joints_.size(), true);
}

Status SimulatedControlBoard::home(std::span<const int> joints) {
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  std::vector<double> home_rad;
  {
    const std::lock_guard lock(robot_->mutex());
    const std::span<const JointState> states = robot_->simulation().joints(part_);
    for (const int joint : joints) home_rad.push_back(states[static_cast<std::size_t>(joint)].home_rad);
  }
  return move_to(joints, home_rad);
}

Result<std::vector<std::string>> SimulatedControlBoard::variable_names() const {
  std::vector<std::string> names = {std::string(kCouplings)};
  for (const Variable& variable : kVariables) names.emplace_back(variable.name);
  return names;
}

Result<std::string> SimulatedControlBoard::variable(const std::string& name) const {
  const std::size_t n = joints_.size();
  if (name == kCouplings) {
    std::vector<std::string_view> matrix(n * n, "0");
    for (std::size_t i = 0; i < n; ++i) matrix[i * n + i] = "1";
    return fmt::format("{}", fmt::join(matrix, " "));
  }
  for (const Variable& variable : kVariables) {
    if (name != variable.name) continue;
    return fmt::format("({})", fmt::join(std::vector<std::string_view>(n, variable.of_each_joint), " "));
  }
  return no_variable(name);
}

Status SimulatedControlBoard::set_variable(const std::string& name, const std::string&) {
  if (!variable(name)) return no_variable(name);
  return Error{ErrorCode::kUnsupported, fmt::format("'{}' of the simulated motors is fixed", name)};
}

}  // namespace nido::sim
