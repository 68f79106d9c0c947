#include "limits/limited_control_board.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "nido/interfaces/check_joints.h"

namespace nido {
namespace {

// a speed towards a limit may at most cover the rest of the way in this time
constexpr double kBrakingTime_s = 0.05;
// a stream that nobody renews ends after 65 of 100 parts of the time in which its joints have to stand: the
// rest is for coming to rest from full speed
std::int64_t good_until_ns(const LimitOptions& options) { return options.command_timeout_ns / 100 * 65; }
// slower joints stand, and nearer ones are at their target
constexpr double kStanding_rad_s = 0.01;
constexpr double kArrived_rad = 0.01;
// nearer to a limit than this, nothing pushes further out
constexpr double kEdge_rad = 0.005;
// speeds that come between two control periods are judged over as long a way as one of these
constexpr double kNominalPeriod_s = 0.01;

constexpr std::array kStreamed = {ControlMode::kDirect, ControlMode::kVelocity, ControlMode::kTorque,
                                  ControlMode::kPwm};

std::size_t at(int joint) { return static_cast<std::size_t>(joint); }

bool is_streamed(ControlMode mode) {
  return std::find(kStreamed.begin(), kStreamed.end(), mode) != kStreamed.end();
}

bool is_in_order(const JointLimits& limits) {
  return std::isfinite(limits.min_rad) && std::isfinite(limits.max_rad) && limits.min_rad <= limits.max_rad &&
         std::isfinite(limits.max_velocity_rad_s) && limits.max_velocity_rad_s > 0 &&
         std::isfinite(limits.max_torque_Nm) && limits.max_torque_Nm >= 0;
}

double clamp_command(ControlMode mode, const JointLimits& limits, double value) {
  switch (mode) {
    case ControlMode::kVelocity:
      return std::clamp(value, -limits.max_velocity_rad_s, limits.max_velocity_rad_s);
    case ControlMode::kTorque:
      return std::clamp(value, -limits.max_torque_Nm, limits.max_torque_Nm);
    case ControlMode::kPwm:
      return std::clamp(value, -1.0, 1.0);
    default:
      return std::clamp(value, limits.min_rad, limits.max_rad);
  }
}

// What a stream is made of, in a sentence.
const char* kind_of(ControlMode mode) {
  switch (mode) {
    case ControlMode::kDirect:
      return "target";
    case ControlMode::kVelocity:
      return "speed";
    case ControlMode::kTorque:
      return "torque";
    default:
      return "duty cycle";
  }
}

// There is something to end when nobody renews the stream.
bool is_on_its_way(const LimitedControlBoard::Stream& stream) {
  return stream.mode == ControlMode::kDirect     ? stream.wanted != stream.sent
         : stream.mode == ControlMode::kVelocity ? stream.wanted != 0
                                                 : true;
}

// Motions of mode position have speeds of their own from the start.
Status slow_down(IControlBoard& device, const std::vector<JointLimits>& limits) {
  const Result<std::vector<double>> speeds = device.reference_speeds();
  if (!speeds) return speeds.error();
  std::vector<int> joints;
  std::vector<double> slower;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    if ((*speeds)[i] <= limits[i].max_velocity_rad_s) continue;
    joints.push_back(static_cast<int>(i));
    slower.push_back(limits[i].max_velocity_rad_s);
  }
  return joints.empty() ? Status() : device.set_reference_speeds(joints, slower);
}

}  // namespace

Result<std::unique_ptr<LimitedControlBoard>> LimitedControlBoard::create(IControlBoard& device,
                                                                         const IClock& clock,
                                                                         LimitOptions options) {
  Result<std::vector<JointLimits>> told = device.limits();
  if (!told) return told.error();
  std::vector<JointLimits> limits = std::move(*told);
  if (limits.size() != at(device.axes())) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}: the device tells limits of {} joints but has {}", options.part,
                             limits.size(), device.axes())};
  }
  if (!options.narrower.empty() && options.narrower.size() != limits.size()) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}: narrower limits for {} joints, expected {}", options.part,
                             options.narrower.size(), limits.size())};
  }
  for (std::size_t i = 0; i < limits.size(); ++i) {
    if (!options.narrower.empty()) {
      const JointLimits& narrower = options.narrower[i];
      limits[i] = {std::max(limits[i].min_rad, narrower.min_rad),
                   std::min(limits[i].max_rad, narrower.max_rad),
                   std::min(limits[i].max_velocity_rad_s, narrower.max_velocity_rad_s),
                   std::min(limits[i].max_torque_Nm, narrower.max_torque_Nm)};
    }
    if (!is_in_order(limits[i])) {
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("{}: limits of joint {} are out of order: {}..{} rad, {} rad/s, {} N m",
                               options.part, i, limits[i].min_rad, limits[i].max_rad,
                               limits[i].max_velocity_rad_s, limits[i].max_torque_Nm)};
    }
  }
  if (const bool may = !options.safety || options.safety->may_command().ok();
      may && !options.narrower.empty()) {
    if (Status slower = slow_down(device, limits); !slower) return slower.error();
  }
  return std::unique_ptr<LimitedControlBoard>(
      new LimitedControlBoard(device, clock, std::move(options), std::move(limits)));
}

LimitedControlBoard::LimitedControlBoard(IControlBoard& device, const IClock& clock, LimitOptions options,
                                         std::vector<JointLimits> limits)
    : device_(device),
      clock_(clock),
      options_(std::move(options)),
      widest_(std::move(limits)),
      limits_(widest_),
      streams_(limits_.size()),
      axes_(options_.workspace ? options_.workspace->axes_of(device) : std::vector<int>()),
      target_rad_(limits_.size()),
      is_driven_(limits_.size(), false),
      stepped_ns_(clock.now_ns()) {
  const Result<JointReading> reading = device.read_joints();
  if (options_.workspace && reading) options_.workspace->note(axes_, reading->position_rad, target_rad_);
}

double LimitedControlBoard::allowed(const Stream& stream, const JointLimits& limits, double position_rad,
                                    double dt_s) const {
  switch (stream.mode) {
    case ControlMode::kDirect: {
      const double reach_rad = limits.max_velocity_rad_s * dt_s;
      return stream.sent + std::clamp(stream.wanted - stream.sent, -reach_rad, reach_rad);
    }
    case ControlMode::kVelocity: {
      const double up_rad_s = std::max(0.0, limits.max_rad - position_rad) / kBrakingTime_s;
      const double down_rad_s = std::max(0.0, position_rad - limits.min_rad) / kBrakingTime_s;
      return std::clamp(stream.wanted, -down_rad_s, up_rad_s);
    }
    default: {
      const bool pushes_out = (stream.wanted > 0 && position_rad > limits.max_rad - kEdge_rad) ||
                              (stream.wanted < 0 && position_rad < limits.min_rad + kEdge_rad);
      return pushes_out ? 0.0 : stream.wanted;
    }
  }
}

Status LimitedControlBoard::send(ControlMode mode, std::span<const int> joints,
                                 std::span<const double> values) {
  switch (mode) {
    case ControlMode::kDirect:
      return device_.set_positions(joints, values);
    case ControlMode::kVelocity:
      return device_.set_velocities(joints, values);
    case ControlMode::kTorque:
      return device_.set_torques(joints, values);
    case ControlMode::kPwm:
      return device_.set_duty_cycles(joints, values);
    default:
      return device_.move_to(joints, values);
  }
}

Status LimitedControlBoard::stream(ControlMode mode, std::span<const int> joints,
                                   std::span<const double> values) {
  const std::lock_guard lock(mutex_);
  if (Status valid = check_joint_values(axes(), joints, values); !valid) return valid;
  if (joints.empty()) return {};
  if (Status may = may_command(); !may) return may;
  const Result<JointReading> reading = device_.read_joints();
  if (!reading) return reading.error();
  std::vector<Stream> next = streams_;
  std::vector<double> now_sent;
  if (options_.workspace && (mode == ControlMode::kTorque || mode == ControlMode::kPwm)) {
    std::string rule;
    for (const int joint : options_.workspace->near_a_border(axes_, rule)) {
      if (std::find(joints.begin(), joints.end(), joint) == joints.end()) continue;
      return Error{
          ErrorCode::kFailed,
          fmt::format("{} joint {}: so near to the border '{}' of the workspace no force is put on it",
                      options_.part, joint, rule)};
    }
  }
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const std::size_t j = at(joints[i]);
    Stream& entry = next[j];
    if (entry.mode != mode) {
      entry.mode = mode;
      entry.sent = std::clamp(reading->position_rad[j], limits_[j].min_rad, limits_[j].max_rad);
    }
    entry.wanted = clamp_command(mode, limits_[j], values[i]);
    entry.renewed_ns = clock_.now_ns();
    // a direct target moves on in step_to only, by as much as a control period allows
    now_sent.push_back(allowed(entry, limits_[j], reading->position_rad[j], 0.0));
  }
  if (mode == ControlMode::kVelocity) (void)brake(mode, joints, now_sent, *reading, kNominalPeriod_s);
  for (std::size_t i = 0; i < joints.size(); ++i) next[at(joints[i])].sent = now_sent[i];
  if (Status sent = send(mode, joints, now_sent); !sent) return sent;
  forget(joints);
  for (const int joint : joints) streams_[at(joint)] = next[at(joint)];
  return {};
}

Status LimitedControlBoard::step_to(std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  const double dt_s = static_cast<double>(now_ns - stepped_ns_) * 1e-9;
  stepped_ns_ = now_ns;
  halt(now_ns);
  const bool streams = std::any_of(streams_.begin(), streams_.end(),
                                   [](const Stream& stream) { return is_streamed(stream.mode); });
  if (!streams && !options_.workspace) return {};
  const Result<JointReading> reading = device_.read_joints();
  if (!reading) return reading.error();
  if (options_.workspace) options_.workspace->note(axes_, reading->position_rad, target_rad_);
  if (Status inside = stay_inside(*reading); !inside) return inside;
  std::optional<std::string> border;
  const double good_until_s = static_cast<double>(good_until_ns(options_)) * 1e-9;
  for (const ControlMode mode : kStreamed) {
    std::vector<int> joints;
    std::vector<double> values;
    std::vector<int> to_hold;
    std::vector<int> ending;  // streams that end in this period with nothing left to do
    bool is_at_rest = true;   // their joints
    for (int joint = 0; joint < axes(); ++joint) {
      Stream& entry = streams_[at(joint)];
      if (entry.mode != mode) continue;
      const double age_s = static_cast<double>(now_ns - entry.renewed_ns) * 1e-9;
      const bool late = age_s > good_until_s;
      if (late && is_on_its_way(entry)) {
        to_hold.push_back(joint);
        report(joint, kind_of(mode));
        continue;
      }
      if (late && age_s - dt_s <= good_until_s) {
        const double left_rad =
            mode == ControlMode::kDirect ? entry.sent - reading->position_rad[at(joint)] : 0;
        is_at_rest = is_at_rest && std::abs(left_rad) < kArrived_rad &&
                     std::abs(reading->velocity_rad_s[at(joint)]) < kStanding_rad_s;
        ending.push_back(joint);
      }
      joints.push_back(joint);
      values.push_back(
          allowed(entry, limits_[at(joint)], reading->position_rad[at(joint)], std::max(dt_s, 0.0)));
    }
    if (mode == ControlMode::kDirect || mode == ControlMode::kVelocity) {
      if (const auto rule = brake(mode, joints, values, *reading, dt_s)) border = rule;
    }
    if (Status sent = send_changes(mode, joints, values); !sent) return sent;
    // what others of the stream do when they are stopped moves these, too
    if (!is_at_rest || !to_hold.empty()) to_hold.insert(to_hold.end(), ending.begin(), ending.end());
    if (Status held = hold(to_hold); !held) return held;
  }
  tell_border(border);
  return {};
}

Status LimitedControlBoard::send_changes(ControlMode mode, std::span<const int> all_joints,
                                         std::span<const double> all_values) {
  std::vector<int> joints;
  std::vector<double> values;
  for (std::size_t i = 0; i < all_joints.size(); ++i) {
    double& sent = streams_[at(all_joints[i])].sent;
    if (sent == all_values[i]) continue;
    sent = all_values[i];
    joints.push_back(all_joints[i]);
    values.push_back(all_values[i]);
  }
  if (joints.empty()) return {};
  const Status sent = send(mode, joints, values);
  if (!sent && sent.error().code != ErrorCode::kFailed) return sent;
  // a joint that broke down meanwhile must not keep the others from what is theirs
  for (std::size_t i = 0; !sent && i < joints.size(); ++i) {
    if (!send(mode, {&joints[i], 1}, {&values[i], 1})) streams_[at(joints[i])] = Stream{};
  }
  return {};
}

void LimitedControlBoard::forget(std::span<const int> joints) {
  for (const int joint : joints) {
    streams_[at(joint)] = Stream{};
    target_rad_[at(joint)].reset();
    is_driven_[at(joint)] = false;
  }
}

void LimitedControlBoard::report(int joint, const std::string& what) const {
  if (!options_.report) return;
  options_.report(fmt::format("{} joint {}: no new {} for {} ms, stopped", options_.part, joint, what,
                              good_until_ns(options_) / 1'000'000));
}

LimitedControlBoard::Memory LimitedControlBoard::memory() const {
  const std::lock_guard lock(mutex_);
  return {streams_, target_rad_, is_driven_, stepped_ns_};
}

Status LimitedControlBoard::set_memory(const Memory& memory) {
  const std::size_t count = widest_.size();
  if (memory.streams.size() != count || memory.target_rad.size() != count ||
      memory.is_driven.size() != count) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("{}: what is remembered is of {} joints, not {}",
                                                          options_.part, memory.streams.size(), count)};
  }
  const std::lock_guard lock(mutex_);
  streams_ = memory.streams;
  target_rad_ = memory.target_rad;
  is_driven_ = memory.is_driven;
  stepped_ns_ = memory.stepped_ns;
  return {};
}

int LimitedControlBoard::axes() const { return static_cast<int>(widest_.size()); }
Result<std::vector<JointLimits>> LimitedControlBoard::limits() const {
  const std::lock_guard lock(mutex_);
  return limits_;
}
Status LimitedControlBoard::set_control_mode(std::span<const int> joints, ControlMode mode) {
  const std::lock_guard lock(mutex_);
  if (Status may = may_command(); !may) return may;
  if (Status set = device_.set_control_mode(joints, mode); !set) return set;
  const Result<JointReading> reading = device_.read_joints();
  if (!reading) return reading.error();
  forget(joints);
  for (const int joint : joints) {
    Stream& entry = streams_[at(joint)];
    if (!is_streamed(mode)) continue;
    entry.mode = mode;
    entry.renewed_ns = clock_.now_ns();
    if (mode == ControlMode::kDirect) entry.wanted = entry.sent = reading->position_rad[at(joint)];
  }
  return {};
}

Status LimitedControlBoard::move_to(std::span<const int> joints, std::span<const double> target_rad) {
  const std::lock_guard lock(mutex_);
  if (Status valid = check_joint_values(axes(), joints, target_rad); !valid) return valid;
  if (Status may = may_command(); !may) return may;
  std::vector<double> clamped(target_rad.begin(), target_rad.end());
  for (std::size_t i = 0; i < joints.size(); ++i) {
    clamped[i] = clamp_command(ControlMode::kPosition, limits_[at(joints[i])], clamped[i]);
  }
  if (options_.workspace) {
    if (Status inside = options_.workspace->check_targets(body_axes(joints), clamped); !inside) return inside;
  }
  if (Status sent = device_.move_to(joints, clamped); !sent) return sent;
  forget(joints);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    target_rad_[at(joints[i])] = clamped[i];
    is_driven_[at(joints[i])] = true;
  }
  note_targets();
  return {};
}

Status LimitedControlBoard::set_reference_speeds(std::span<const int> joints,
                                                 std::span<const double> speed_rad_s) {
  const std::lock_guard lock(mutex_);
  if (Status valid = check_joint_magnitudes(axes(), joints, speed_rad_s); !valid) return valid;
  if (Status may = may_command(); !may) return may;
  std::vector<double> clamped(speed_rad_s.begin(), speed_rad_s.end());
  for (std::size_t i = 0; i < joints.size(); ++i) {
    clamped[i] = std::min(clamped[i], limits_[at(joints[i])].max_velocity_rad_s);
  }
  return device_.set_reference_speeds(joints, clamped);
}

Status LimitedControlBoard::set_reference_accelerations(std::span<const int> joints,
                                                        std::span<const double> acceleration_rad_s2) {
  if (Status valid = check_joint_magnitudes(axes(), joints, acceleration_rad_s2); !valid) return valid;
  if (Status may = may_command(); !may) return may;
  return device_.set_reference_accelerations(joints, acceleration_rad_s2);
}

Status LimitedControlBoard::stop(std::span<const int> joints) {
  const std::lock_guard lock(mutex_);
  // a stop is no harm to a robot that has stopped; one that is only looked at is left alone
  if (Status may = may_command(); !may) {
    return options_.safety->stopped() ? check_joints(axes(), joints) : may;
  }
  if (Status stopped = device_.stop(joints); !stopped) return stopped;
  forget(joints);
  return {};
}

Status LimitedControlBoard::home(std::span<const int> joints) {
  const std::lock_guard lock(mutex_);
  if (Status may = may_command(); !may) return may;
  if (Status begun = device_.home(joints); !begun) return begun;
  forget(joints);
  for (const int joint : joints) is_driven_[at(joint)] = true;
  return {};
}

Status LimitedControlBoard::calibrate(std::span<const int> joints) {
  if (Status may = may_command(); !may) return may;
  return device_.calibrate(joints);
}
Status LimitedControlBoard::set_pids(PidLoop loop, std::span<const int> joints, std::span<const Pid> pids) {
  if (Status may = may_command(); !may) return may;
  return device_.set_pids(loop, joints, pids);
}
Status LimitedControlBoard::set_interaction_mode(std::span<const int> joints, InteractionMode mode) {
  if (Status may = may_command(); !may) return may;
  return device_.set_interaction_mode(joints, mode);
}
Status LimitedControlBoard::set_impedances(std::span<const int> joints,
                                           std::span<const Impedance> impedances) {
  if (Status may = may_command(); !may) return may;
  return device_.set_impedances(joints, impedances);
}
Status LimitedControlBoard::set_variable(const std::string& name, const std::string& value) {
  if (Status may = may_command(); !may) return may;
  return device_.set_variable(name, value);
}

Status LimitedControlBoard::set_positions(std::span<const int> joints, std::span<const double> target_rad) {
  return stream(ControlMode::kDirect, joints, target_rad);
}
Status LimitedControlBoard::set_velocities(std::span<const int> joints,
                                           std::span<const double> velocity_rad_s) {
  return stream(ControlMode::kVelocity, joints, velocity_rad_s);
}
Status LimitedControlBoard::set_torques(std::span<const int> joints, std::span<const double> torque_Nm) {
  return stream(ControlMode::kTorque, joints, torque_Nm);
}
Status LimitedControlBoard::set_duty_cycles(std::span<const int> joints, std::span<const double> duty_cycle) {
  return stream(ControlMode::kPwm, joints, duty_cycle);
}

Result<std::vector<double>> LimitedControlBoard::commanded(ControlMode mode) const {
  const std::lock_guard lock(mutex_);
  std::vector<double> values(streams_.size(), 0.0);
  if (mode == ControlMode::kDirect) {
    Result<std::vector<double>> targets = device_.target_positions();
    if (!targets) return targets.error();
    values = std::move(*targets);
  }
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    if (is_streamed(mode) && streams_[i].mode == mode) values[i] = streams_[i].wanted;
  }
  return values;
}

Status LimitedControlBoard::set_position_limits(int joint, double min_rad, double max_rad) {
  const int joints[] = {joint};
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  const std::lock_guard lock(mutex_);
  if (Status may = may_command(); !may) return may;
  const JointLimits& widest = widest_[at(joint)];
  const double low_rad = std::clamp(min_rad, widest.min_rad, widest.max_rad);
  const double high_rad = std::clamp(max_rad, widest.min_rad, widest.max_rad);
  if (!std::isfinite(min_rad) || !std::isfinite(max_rad) || !(low_rad < high_rad)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("limits {} to {} rad of joint {} leave nothing: it can go from {} to {}",
                             min_rad, max_rad, joint, widest.min_rad, widest.max_rad)};
  }
  const Result<std::vector<bool>> done = device_.motion_done();
  if (!done) return done.error();
  const Result<std::vector<double>> targets = device_.target_positions();
  if (!targets) return targets.error();
  limits_[at(joint)].min_rad = low_rad;
  limits_[at(joint)].max_rad = high_rad;
  Stream& stream = streams_[at(joint)];
  if (stream.mode == ControlMode::kDirect) stream.wanted = std::clamp(stream.wanted, low_rad, high_rad);
  const double target_rad[] = {std::clamp((*targets)[at(joint)], low_rad, high_rad)};
  if (is_streamed(stream.mode) || (*done)[at(joint)] || target_rad[0] == (*targets)[at(joint)]) return {};
  if (target_rad_[at(joint)]) target_rad_[at(joint)] = target_rad[0];
  return device_.move_to(joints, target_rad);
}

Status LimitedControlBoard::set_velocity_limit(int joint, double max_rad_s) {
  const int joints[] = {joint};
  const double speed_rad_s[] = {max_rad_s};
  if (Status valid = check_joint_magnitudes(axes(), joints, speed_rad_s); !valid) return valid;
  const std::lock_guard lock(mutex_);
  if (Status may = may_command(); !may) return may;
  const Result<std::vector<double>> speeds = device_.reference_speeds();
  if (!speeds) return speeds.error();
  JointLimits& limits = limits_[at(joint)];
  limits.max_velocity_rad_s = std::min(max_rad_s, widest_[at(joint)].max_velocity_rad_s);
  Stream& stream = streams_[at(joint)];
  if (stream.mode == ControlMode::kVelocity)
    stream.wanted = clamp_command(stream.mode, limits, stream.wanted);
  if ((*speeds)[at(joint)] <= limits.max_velocity_rad_s) return {};
  return device_.set_reference_speeds(joints, {&limits.max_velocity_rad_s, 1});
}

Result<std::vector<double>> LimitedControlBoard::greatest_currents() const {
  if (const auto* currents = dynamic_cast<const ICurrentRange*>(&device_))
    return currents->greatest_currents();
  return Error{ErrorCode::kUnsupported, "the currents of this board are not known"};
}

std::vector<std::string> describe_limits(const std::string& part, const IControlBoard& board) {
  constexpr double kDegree = 180.0 / std::numbers::pi;
  std::vector<std::string> lines;
  const Result<std::vector<JointLimits>> limits = board.limits();
  if (!limits) return {fmt::format("{}: {}", part, limits.error().message)};
  for (int joint = 0; joint < board.axes(); ++joint) {
    const JointLimits& joint_limits = (*limits)[at(joint)];
    const Result<std::string> name = board.axis_name(joint);
    lines.push_back(fmt::format("{} {} {}: {:.1f}..{:.1f} deg, {:.0f} deg/s, {:.3g} N m", part, joint,
                                name ? *name : "?", joint_limits.min_rad * kDegree,
                                joint_limits.max_rad * kDegree, joint_limits.max_velocity_rad_s * kDegree,
                                joint_limits.max_torque_Nm));
  }
  return lines;
}

}  // namespace nido
