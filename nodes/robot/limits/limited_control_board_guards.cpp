// How a board keeps to the emergency stop and to the borders of the workspace.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>

#include "limits/limited_control_board.h"
#include "nido/interfaces/check_joints.h"

namespace nido {
namespace {

// time between two tries to stop a device that does not answer
constexpr std::int64_t kRetry_ns = 500'000'000;

std::size_t at(int joint) { return static_cast<std::size_t>(joint); }

}  // namespace

// one joint after the other, so that one that is broken does not keep the others from stopping
Status LimitedControlBoard::hold(std::span<const int> joints) {
  for (const int joint : joints) {
    const int one[] = {joint};
    if (const Status held = device_.stop(one); !held && held.error().code != ErrorCode::kFailed) return held;
  }
  forget(joints);
  return {};
}

Status LimitedControlBoard::act_on(std::span<const int> joints) {
  return options_.safety->action() == StopAction::kIdle ? device_.set_control_mode(joints, ControlMode::kIdle)
                                                        : device_.stop(joints);
}

void LimitedControlBoard::halt(std::int64_t now_ns) {
  if (!options_.safety || !options_.safety->stopped()) {
    is_halted_ = false;
    next_halt_ns_ = now_ns;
    return;
  }
  if (is_halted_ || now_ns < next_halt_ns_) return;
  const std::vector<int> joints = all_joints(axes());
  forget(joints);
  Status acted = act_on(joints);
  // one that is broken must not keep the others from stopping
  if (!acted && acted.error().code == ErrorCode::kFailed) {
    acted = {};
    for (const int joint : joints) {
      const Status one = act_on({&joint, 1});
      if (!one && one.error().code != ErrorCode::kFailed) acted = one;
    }
  }
  is_halted_ = acted.ok();
  next_halt_ns_ = now_ns + kRetry_ns;
  if (!acted && options_.warn) {
    options_.warn(fmt::format("{} has not obeyed the emergency stop: {}; it is tried again", options_.part,
                              acted.error().message));
  }
}

std::optional<std::string> LimitedControlBoard::brake(ControlMode mode, std::span<const int> joints,
                                                      std::span<double> values, const JointReading& reading,
                                                      double dt_s) {
  if (!options_.workspace || dt_s <= 0 || joints.empty()) return std::nullopt;
  std::vector<int> axes;
  std::vector<double> from_rad;
  std::vector<double> step_rad;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const std::size_t j = at(joints[i]);
    const bool by_speed = mode == ControlMode::kVelocity;
    axes.push_back(axes_[j]);
    from_rad.push_back(by_speed ? reading.position_rad[j] : streams_[j].sent);
    step_rad.push_back(by_speed ? values[i] * dt_s : values[i] - streams_[j].sent);
  }
  const auto rule = options_.workspace->brake(axes, from_rad, step_rad, dt_s);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (rule) values[i] = mode == ControlMode::kVelocity ? step_rad[i] / dt_s : from_rad[i] + step_rad[i];
  }
  return rule;
}

void LimitedControlBoard::tell_border(const std::optional<std::string>& rule) {
  if (rule == border_) return;
  border_ = rule;
  if (rule && options_.warn) {
    options_.warn(
        fmt::format("{}: slowed down before the border '{}' of the workspace", options_.part, *rule));
  }
}

Status LimitedControlBoard::stay_inside(const JointReading& reading) {
  if (!options_.workspace) return {};
  std::vector<double> velocity_rad_s(streams_.size(), 0.0);
  std::string rule;
  std::vector<int> joints;
  for (const int joint : options_.workspace->near_a_border(axes_, rule)) {
    const ControlMode mode = streams_[at(joint)].mode;
    if (mode == ControlMode::kTorque || mode == ControlMode::kPwm) joints.push_back(joint);
  }
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    const ControlMode mode = streams_[i].mode;
    const bool is_forced = mode == ControlMode::kTorque || mode == ControlMode::kPwm;
    if (is_forced || is_driven_[i]) velocity_rad_s[i] = reading.velocity_rad_s[i];
  }
  const std::vector<int> leaving =
      options_.workspace->to_stop(axes_, reading.position_rad, velocity_rad_s, rule);
  std::copy_if(leaving.begin(), leaving.end(), std::back_inserter(joints),
               [&](int joint) { return std::find(joints.begin(), joints.end(), joint) == joints.end(); });
  if (joints.empty()) return {};
  if (options_.warn) {
    options_.warn(fmt::format("{} joint {}: stopped before the border '{}' of the workspace", options_.part,
                              fmt::join(joints, ", "), rule));
  }
  return hold(joints);
}

std::vector<int> LimitedControlBoard::body_axes(std::span<const int> joints) const {
  std::vector<int> axes;
  for (const int joint : joints) axes.push_back(axes_[at(joint)]);
  return axes;
}

// Two commands within a control period know of each other.
void LimitedControlBoard::note_targets() {
  if (!options_.workspace) return;
  if (const Result<JointReading> reading = device_.read_joints())
    options_.workspace->note(axes_, reading->position_rad, target_rad_);
}

}  // namespace nido
