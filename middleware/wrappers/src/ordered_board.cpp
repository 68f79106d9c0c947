#include "ordered_board.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

namespace nido {
namespace {

// when the wall clock was set meanwhile, times before and after cannot be compared
constexpr std::int64_t kMostDrift_ns = 20'000'000;

template <class Clock>
std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch()).count();
}

}  // namespace

OrderedBoard::OrderedBoard(IControlBoard& board)
    : board_(board), ordered_ns_(static_cast<std::size_t>(board.axes())) {}

// When this returns, no streamed command that was written before is applied any more. The lock is not kept
// during the order itself, which takes its time on the far side of a network.
void OrderedBoard::void_older(std::span<const int> joints) {
  const std::lock_guard lock(mutex_);
  const std::int64_t wall_ns = now_ns<std::chrono::system_clock>();
  wall_minus_steady_ns_ = wall_ns - now_ns<std::chrono::steady_clock>();
  for (const int joint : joints) {
    if (joint >= 0 && joint < axes()) ordered_ns_[static_cast<std::size_t>(joint)] = wall_ns;
  }
}

Status OrderedBoard::apply_streamed(Time written, const std::string& mode, std::span<const int> joints,
                                    std::span<const double> values) {
  const std::optional<ControlMode> known = control_mode_from_string(mode);
  if (!known || *known == ControlMode::kFault) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("mode '{}' is none of position, direct, velocity, torque, pwm, idle",
                             mode.substr(0, 40))};
  }
  const std::lock_guard lock(mutex_);
  const std::int64_t offset_ns = now_ns<std::chrono::system_clock>() - now_ns<std::chrono::steady_clock>();
  if (std::abs(offset_ns - wall_minus_steady_ns_) > kMostDrift_ns) {
    std::fill(ordered_ns_.begin(), ordered_ns_.end(), std::nullopt);
  }
  const auto is_void = [&](int joint) {
    return joint >= 0 && joint < axes() &&
           written.ns < ordered_ns_[static_cast<std::size_t>(joint)].value_or(0);
  };
  // an idle command has no values
  const bool is_well_formed = *known == ControlMode::kIdle || joints.size() == values.size();
  if (!is_well_formed || std::none_of(joints.begin(), joints.end(), is_void)) {
    return apply(*known, joints, values);
  }
  std::vector<int> left;
  std::vector<double> left_values;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (is_void(joints[i])) continue;
    left.push_back(joints[i]);
    if (i < values.size()) left_values.push_back(values[i]);
  }
  return left.empty() ? Status() : apply(*known, left, left_values);
}

Status OrderedBoard::apply(ControlMode mode, std::span<const int> joints, std::span<const double> values) {
  switch (mode) {
    case ControlMode::kPosition:
      return board_.move_to(joints, values);
    case ControlMode::kDirect:
      return board_.set_positions(joints, values);
    case ControlMode::kVelocity:
      return board_.set_velocities(joints, values);
    case ControlMode::kTorque:
      return board_.set_torques(joints, values);
    case ControlMode::kPwm:
      return board_.set_duty_cycles(joints, values);
    case ControlMode::kIdle:
    case ControlMode::kFault:
      break;
  }
  return board_.set_control_mode(joints, mode);
}

namespace {

template <class Extra, class Board, class Ask>
auto ask_extra(Board& board, const Ask& ask) -> decltype(ask(*dynamic_cast<Extra*>(&board))) {
  if (auto* extra = dynamic_cast<Extra*>(&board)) return ask(*extra);
  return Error{ErrorCode::kUnsupported, "this board does not have it"};
}

}  // namespace

Result<std::vector<double>> OrderedBoard::commanded(ControlMode mode) const {
  return ask_extra<const ICommanded>(board_, [&](const ICommanded& b) { return b.commanded(mode); });
}
Status OrderedBoard::set_position_limits(int joint, double min_rad, double max_rad) {
  return ask_extra<ILimitSettings>(
      board_, [&](ILimitSettings& b) { return b.set_position_limits(joint, min_rad, max_rad); });
}
Status OrderedBoard::set_velocity_limit(int joint, double max_rad_s) {
  return ask_extra<ILimitSettings>(board_,
                                   [&](ILimitSettings& b) { return b.set_velocity_limit(joint, max_rad_s); });
}
Result<std::vector<double>> OrderedBoard::greatest_currents() const {
  return ask_extra<const ICurrentRange>(board_, [](const ICurrentRange& b) { return b.greatest_currents(); });
}

Status OrderedBoard::set_control_mode(std::span<const int> joints, ControlMode mode) {
  void_older(joints);
  return board_.set_control_mode(joints, mode);
}
Status OrderedBoard::move_to(std::span<const int> joints, std::span<const double> target_rad) {
  void_older(joints);
  return board_.move_to(joints, target_rad);
}
Status OrderedBoard::stop(std::span<const int> joints) {
  void_older(joints);
  return board_.stop(joints);
}
Status OrderedBoard::home(std::span<const int> joints) {
  void_older(joints);
  return board_.home(joints);
}
Status OrderedBoard::set_positions(std::span<const int> joints, std::span<const double> target_rad) {
  void_older(joints);
  return board_.set_positions(joints, target_rad);
}
Status OrderedBoard::set_velocities(std::span<const int> joints, std::span<const double> velocity_rad_s) {
  void_older(joints);
  return board_.set_velocities(joints, velocity_rad_s);
}
Status OrderedBoard::set_torques(std::span<const int> joints, std::span<const double> torque_Nm) {
  void_older(joints);
  return board_.set_torques(joints, torque_Nm);
}
Status OrderedBoard::set_duty_cycles(std::span<const int> joints, std::span<const double> duty_cycle) {
  void_older(joints);
  return board_.set_duty_cycles(joints, duty_cycle);
}

}  // namespace nido
