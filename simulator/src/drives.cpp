#include "drives.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "servo.h"

namespace nido::sim {
namespace {

constexpr double kServoGain_1_s = 60;  // the servo removes an error within about 1/gain
constexpr double kFingerGain_1_s = 40;
constexpr double kVelocityLeash_rad =
    0.1;  // velocity mode: how far its reference may run ahead of a blocked joint
constexpr double kIdleFriction = 0.01;  // share of the largest torque that a motor without power resists with
constexpr double kStandstill_rad_s = 1e-3;  // slower joints stand, as far as friction is concerned
constexpr double kSlowest_rad_s = 1e-4;     // slower motions would take days, and their sums overflow
constexpr double kDone_rad = 0.0174533;     // 1 degree
// age of the trajectory of a joint that brakes: it is counted up while the joint stands, for so many periods
constexpr std::int64_t kBrakes = -10;
constexpr double kBraked_rad_s = 0.01;        // slower joints have braked
constexpr double kPeakOfMinimumJerk = 1.875;  // highest by mean velocity

std::string number(double value) {
  std::string text = std::to_string(value);
  return text;
}

// It has been stopped and does not stand yet.
bool is_braking(const AxisState& axis) {
  return axis.measured.mode == JointMode::kPosition && axis.trajectory.age < 0;
}

// What a motor has left of its torque beside the weight that it bears.
double spare_torque_Nm(double most_Nm, double gravity_Nm) {
  return std::max(most_Nm - std::abs(gravity_Nm), 0.1 * most_Nm);
}

}  // namespace

const char* to_string(JointMode mode) {
  switch (mode) {
    case JointMode::kIdle:
      return "idle";
    case JointMode::kPosition:
      return "position";
    case JointMode::kDirect:
      return "direct";
    case JointMode::kVelocity:
      return "velocity";
    case JointMode::kTorque:
      return "torque";
    case JointMode::kPwm:
      return "pwm";
  }
  return "idle";
}

Result<Drives> Drives::create(const RobotBody& robot, const ControlBlock& block) {
  Drives drives;
  std::map<std::string, std::size_t> link_of_hinge;
  for (std::size_t i = 1; i < robot.link_count(); ++i)
    link_of_hinge[robot.description().links[i].joint_name] = i;
  drives.hinges_.resize(robot.link_count());

  for (const PartBlock& part : block.parts) {
    drives.first_axis_.push_back(drives.axis_info_.size());
    PartInfo info{part.name, {}};
    for (const AxisBlock& axis : part.axes) {
      Axis own{static_cast<int>(drives.parts_.size()), axis.info, axis.home_rad, kServoGain_1_s, {}};
      for (const HingeShare& share : axis.hinges) {
        const auto found = link_of_hinge.find(share.hinge);
        if (found == link_of_hinge.end()) {
          return Error{ErrorCode::kInvalidArgument, "joint " + axis.info.name + " moves the hinge " +
                                                        share.hinge + ", which the robot does not have"};
        }
        own.shares.push_back({found->second, share.multiplier, share.offset_rad});
        Hinge& hinge = drives.hinges_[found->second];
        hinge.axes.emplace_back(drives.axis_info_.size(), share.multiplier);
        hinge.offset_rad += share.offset_rad;
        const LinkDescription& link = robot.description().links[found->second];
        hinge.max_torque_Nm = link.max_torque_Nm;
        hinge.max_velocity_rad_s = std::max(link.max_velocity_rad_s, 0.0);
        hinge.top_speed_rad_s += std::abs(share.multiplier) * axis.info.max_velocity_rad_s;
        if (link.max_torque_Nm < 0.9) own.gain_1_s = kFingerGain_1_s;
      }
      drives.axis_info_.push_back(own);
      info.joints.push_back(axis.info);
    }
    drives.parts_.push_back(std::move(info));
  }
  for (Hinge& hinge : drives.hinges_) {
    hinge.top_speed_rad_s = std::min(hinge.top_speed_rad_s, hinge.max_velocity_rad_s);
  }
  for (std::size_t i = 1; i < robot.link_count(); ++i) {
    if (drives.hinges_[i].axes.empty() && !robot.floats(i)) {
      return Error{ErrorCode::kInvalidArgument, "no joint of the <nido> element moves the hinge " +
                                                    robot.description().links[i].joint_name};
    }
  }

  // pseudo-inverse of the coupling, for reading the joints off the hinges
  const auto rows = static_cast<Eigen::Index>(robot.link_count());
  const auto columns = static_cast<Eigen::Index>(drives.axis_info_.size());
  Eigen::MatrixXd coupling = Eigen::MatrixXd::Zero(rows, columns);
  for (Eigen::Index a = 0; a < columns; ++a) {
    for (const Share& s : drives.axis_info_[static_cast<std::size_t>(a)].shares) {
      coupling(static_cast<Eigen::Index>(s.link), a) += s.multiplier;
    }
  }
  const Eigen::MatrixXd inverse = (coupling.transpose() * coupling).ldlt().solve(coupling.transpose());
  drives.inverse_.resize(drives.axis_info_.size());
  for (Eigen::Index a = 0; a < columns; ++a) {
    for (Eigen::Index r = 0; r < rows; ++r) {
      if (std::abs(inverse(a, r)) > 1e-9) {
        drives.inverse_[static_cast<std::size_t>(a)].emplace_back(static_cast<std::size_t>(r), inverse(a, r));
      }
    }
  }
  drives.axes_.resize(drives.axis_info_.size());
  drives.gravity_Nm_.assign(robot.link_count(), 0);
  drives.hinge_torque_Nm_.assign(robot.link_count(), 0);
  for (const PartInfo& part : drives.parts_) drives.measured_.emplace_back(part.joints.size());
  return drives;
}

std::vector<double> Drives::hinge_angles(const std::vector<double>& axis_rad) const {
  std::vector<double> angle(hinges_.size(), 0);
  for (std::size_t i = 1; i < hinges_.size(); ++i) {
    angle[i] = hinges_[i].offset_rad;
    for (const auto& [axis, multiplier] : hinges_[i].axes) angle[i] += multiplier * axis_rad[axis];
  }
  return angle;
}

void Drives::go_home(RobotBody& robot) {
  std::vector<double> home(axes_.size());
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    home[a] = axis_info_[a].home_rad;
    axes_[a] = {};
    axes_[a].measured.reference_speed_rad_s = axis_info_[a].info.default_speed_rad_s;
    axes_[a].measured.target = home[a];
    axes_[a].measured.position_rad = home[a];
    axes_[a].reference_rad = home[a];
    axes_[a].previous_reference_rad = home[a];
    axes_[a].trajectory.coefficient[0] = home[a];
    axes_[a].measured.servo_gain_1_s = axis_info_[a].gain_1_s;
  }
  set_hinge_gains();
  robot.put_base_back();
  robot.place(hinge_angles(home));
  std::fill(hinge_torque_Nm_.begin(), hinge_torque_Nm_.end(), 0.0);
  publish();
}

Status Drives::check_positions(int part, std::span<const double> position_rad) const {
  if (part < 0 || part >= static_cast<int>(parts_.size())) {
    return Error{ErrorCode::kInvalidArgument, "no part has the index " + std::to_string(part)};
  }
  const PartInfo& info = parts_[static_cast<std::size_t>(part)];
  if (position_rad.size() != info.joints.size()) {
    return Error{ErrorCode::kInvalidArgument, info.name + " has " + std::to_string(info.joints.size()) +
                                                  " joints, not " + std::to_string(position_rad.size())};
  }
  for (std::size_t j = 0; j < position_rad.size(); ++j) {
    if (!(position_rad[j] >= info.joints[j].min_rad - 1e-9 &&
          position_rad[j] <= info.joints[j].max_rad + 1e-9)) {
      return Error{ErrorCode::kInvalidArgument,
                   info.joints[j].name + " cannot be at " + number(position_rad[j]) + " rad: allowed are " +
                       number(info.joints[j].min_rad) + " to " + number(info.joints[j].max_rad)};
    }
  }
  return {};
}

Status Drives::set_home(int part, std::span<const double> position_rad) {
  if (Status fits = check_positions(part, position_rad); !fits) return fits;
  for (std::size_t j = 0; j < position_rad.size(); ++j) {
    axis_info_[axis_index(part, static_cast<int>(j))].home_rad = position_rad[j];
  }
  return {};
}

Status Drives::place(int part, std::span<const double> position_rad, RobotBody& robot) {
  if (Status fits = check_positions(part, position_rad); !fits) return fits;
  // all other joints stay where they are measured
  std::vector<double> angle(axes_.size());
  for (std::size_t a = 0; a < axes_.size(); ++a) angle[a] = axes_[a].measured.position_rad;
  for (std::size_t j = 0; j < position_rad.size(); ++j) {
    const std::size_t a = axis_index(part, static_cast<int>(j));
    angle[a] = position_rad[j];
    AxisState& state = axes_[a];
    state.measured.mode = JointMode::kPosition;
    state.measured.target = position_rad[j];
    state.measured.motion_done = true;
    state.reference_rad = position_rad[j];
    state.previous_reference_rad = position_rad[j];
    state.reference_velocity_rad_s = 0;
    state.trajectory = {};
    state.trajectory.coefficient[0] = position_rad[j];
  }
  robot.place(hinge_angles(angle));
  steps_ = 0;
  measure(robot);
  return {};
}

Status Drives::check_joint(int part, int joint) const {
  if (part < 0 || part >= static_cast<int>(parts_.size())) {
    return Error{ErrorCode::kInvalidArgument, "no part has the index " + std::to_string(part) +
                                                  "; there are " + std::to_string(parts_.size())};
  }
  const PartInfo& info = parts_[static_cast<std::size_t>(part)];
  if (joint < 0 || joint >= static_cast<int>(info.joints.size())) {
    return Error{ErrorCode::kInvalidArgument, info.name + " has no joint " + std::to_string(joint) +
                                                  "; its joints are 0 to " +
                                                  std::to_string(info.joints.size() - 1)};
  }
  return {};
}

Status Drives::command(int part, JointMode mode, std::span<const int> joints,
                       std::span<const double> values) {
  if (joints.size() != values.size()) {
    return Error{ErrorCode::kInvalidArgument, "a command names " + std::to_string(joints.size()) +
                                                  " joints but gives " + std::to_string(values.size()) +
                                                  " values"};
  }
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (Status known = check_joint(part, joints[i]); !known) return known;
    if (std::count(joints.begin(), joints.end(), joints[i]) > 1) {
      return Error{ErrorCode::kInvalidArgument, "a command names joint " + std::to_string(joints[i]) +
                                                    " of " + parts_[static_cast<std::size_t>(part)].name +
                                                    " twice"};
    }
    if (!std::isfinite(values[i])) {
      return Error{ErrorCode::kInvalidArgument, std::string("the value for ") +
                                                    axis_info_[axis_index(part, joints[i])].info.name +
                                                    " is not a finite number"};
    }
  }
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const std::size_t a = axis_index(part, joints[i]);
    const JointInfo& info = axis_info_[a].info;
    AxisState& state = axes_[a];
    // coming from a mode without servo, the reference starts where the joint is
    if (is_servo(mode) && !is_servo(state.measured.mode)) {
      state.reference_rad = std::clamp(state.measured.position_rad, info.min_rad, info.max_rad);
      state.previous_reference_rad = state.reference_rad;
      state.reference_velocity_rad_s = 0;
    }
    const bool same_mode = state.measured.mode == mode;
    state.measured.mode = mode;
    double target = values[i];
    switch (mode) {
      case JointMode::kIdle:
        target = 0;
        break;
      case JointMode::kPosition:
        target = std::clamp(target, info.min_rad, info.max_rad);
        // the same target again is not a new motion
        if (!same_mode || target != state.measured.target) start_trajectory(a, target);
        break;
      case JointMode::kDirect:
        target = std::clamp(target, info.min_rad, info.max_rad);
        break;
      case JointMode::kVelocity:
        target = std::clamp(target, -info.max_velocity_rad_s, info.max_velocity_rad_s);
        break;
      case JointMode::kTorque:
        target = std::clamp(target, -info.max_torque_Nm, info.max_torque_Nm);
        break;
      case JointMode::kPwm:
        target = std::clamp(target, -1.0, 1.0);
        break;
    }
    state.measured.target = target;
    state.measured.motion_done = mode != JointMode::kPosition;
  }
  publish();
  return {};
}

Status Drives::set_reference_speed(int part, int joint, double speed_rad_s) {
  if (Status known = check_joint(part, joint); !known) return known;
  const std::size_t a = axis_index(part, joint);
  if (!std::isfinite(speed_rad_s) || speed_rad_s <= 0) {
    return Error{ErrorCode::kInvalidArgument, "the reference speed of " + axis_info_[a].info.name +
                                                  " must be a number above zero (rad/s)"};
  }
  axes_[a].measured.reference_speed_rad_s =
      std::min(std::max(speed_rad_s, kSlowest_rad_s), axis_info_[a].info.max_velocity_rad_s);
  publish();
  return {};
}

Status Drives::set_servo_gain(int part, int joint, double gain_1_s) {
  constexpr double kLeast_1_s = 1;
  constexpr double kMost_1_s = 100;  // beyond, a servo that acts every millisecond would swing
  if (Status known = check_joint(part, joint); !known) return known;
  const std::size_t a = axis_index(part, joint);
  if (!(gain_1_s >= kLeast_1_s && gain_1_s <= kMost_1_s)) {
    return Error{ErrorCode::kInvalidArgument, "the servo of " + axis_info_[a].info.name +
                                                  " cannot have the gain " + number(gain_1_s) +
                                                  ": allowed are 1 to 100 (1/s)"};
  }
  axes_[a].measured.servo_gain_1_s = gain_1_s;
  set_hinge_gains();
  publish();
  return {};
}

void Drives::set_hinge_gains() {
  for (Hinge& hinge : hinges_) {
    double sum = 0;
    for (const auto& [axis, multiplier] : hinge.axes) sum += axes_[axis].measured.servo_gain_1_s;
    if (!hinge.axes.empty()) hinge.gain_1_s = sum / static_cast<double>(hinge.axes.size());
  }
}

Status Drives::stop(int part, int joint) {
  if (Status known = check_joint(part, joint); !known) return known;
  const std::size_t a = axis_index(part, joint);
  AxisState& state = axes_[a];
  const JointInfo& info = axis_info_[a].info;
  state.measured.mode = JointMode::kPosition;
  state.measured.target = std::clamp(state.measured.position_rad, info.min_rad, info.max_rad);
  state.measured.motion_done = false;
  state.trajectory = {};
  state.trajectory.age = kBrakes;
  state.trajectory.duration_s = -1.5 * period_s_;  // done when it has stood so long
  publish();
  return {};
}

void Drives::start_trajectory(std::size_t axis, double goal_rad) {
  AxisState& state = axes_[axis];
  const JointInfo& info = axis_info_[axis].info;
  const double p0 = state.reference_rad;
  const double v0 = state.reference_velocity_rad_s;
  const double distance = goal_rad - p0;
  // reference speed is the mean speed, the peak stays within the limit
  double duration = std::abs(distance) / state.measured.reference_speed_rad_s;
  duration = std::max({duration, kPeakOfMinimumJerk * std::abs(distance) / info.max_velocity_rad_s, 0.05});
  // time to turn round or brake softly
  if (std::abs(v0) > 1e-6) duration = std::max(duration, 0.2);
  state.trajectory = Trajectory::to(goal_rad, p0, v0, duration);
}

void Drives::advance_reference(std::size_t axis, double period_s) {
  AxisState& state = axes_[axis];
  const JointInfo& info = axis_info_[axis].info;
  // A joint that is held where it was told to stop swings back to there: so it brakes first, and is held
  // where it has stood for a while, with what it presses against then, or it would give way. A finger of
  // several hinges keeps the shape that things have given it only by its brake, until the next command.
  if (is_braking(state)) {
    const std::vector<Share>& shares = axis_info_[axis].shares;
    const bool has_a_shape = shares.size() > 1 && hinges_[shares.front().link].axes.size() == 1;
    double held = state.measured.position_rad;
    state.measured.target = std::clamp(held, info.min_rad, info.max_rad);
    const bool stands = std::abs(state.measured.velocity_rad_s) < kBraked_rad_s;
    state.trajectory.age = stands ? state.trajectory.age + 1 : kBrakes;
    if (has_a_shape) state.trajectory.age = std::min<std::int64_t>(state.trajectory.age, -1);
    if (!is_braking(state)) state.trajectory.duration_s = 0;
    for (const Share& share : shares) {
      if (is_braking(state)) break;
      const double torque = hinge_torque_Nm_[share.link] + gravity_Nm_[share.link];
      const double most = spare_torque_Nm(hinges_[share.link].max_torque_Nm, gravity_Nm_[share.link]);
      held += std::clamp(torque / most, -1.0, 1.0) * kServoGive_rad / share.multiplier /
              static_cast<double>(shares.size());
    }
    held = std::clamp(held, info.min_rad, info.max_rad);
    state.reference_rad = state.previous_reference_rad = state.trajectory.coefficient[0] = held;
    state.reference_velocity_rad_s = 0;
    return;
  }
  state.previous_reference_rad = state.reference_rad;
  double next = state.reference_rad;
  const double reach = info.max_velocity_rad_s * period_s;
  switch (state.measured.mode) {
    case JointMode::kPosition:
      next = state.trajectory.position(static_cast<double>(state.trajectory.age + 1) * period_s);
      break;
    case JointMode::kDirect:
      next = state.measured.target;
      break;
    case JointMode::kVelocity:
      next = state.reference_rad + state.measured.target * period_s;
      next = std::clamp(next, state.measured.position_rad - kVelocityLeash_rad,
                        state.measured.position_rad + kVelocityLeash_rad);
      break;
    default:
      next = state.measured.position_rad;
      break;
  }
  // no reference leaves the limits of position and velocity
  next = std::clamp(next, state.previous_reference_rad - reach, state.previous_reference_rad + reach);
  state.reference_rad = std::clamp(next, info.min_rad, info.max_rad);
  state.reference_velocity_rad_s = (state.reference_rad - state.previous_reference_rad) / period_s;
  ++state.trajectory.age;
}

void Drives::begin_period(double period_s, const RobotBody& robot) {
  period_s_ = period_s;
  robot.gravity_torques(gravity_Nm_);
  for (std::size_t a = 0; a < axes_.size(); ++a) advance_reference(a, period_s);
  std::fill(hinge_torque_Nm_.begin(), hinge_torque_Nm_.end(), 0.0);
  steps_ = 0;
}

std::pair<double, double> Drives::motion_of(std::size_t axis, const RobotBody& robot) const {
  double position = 0;
  double velocity = 0;
  for (const auto& [link, factor] : inverse_[axis]) {
    position += factor * (robot.angle_rad(link) - hinges_[link].offset_rad);
    velocity += factor * robot.velocity_rad_s(link);
  }
  return {position, velocity};
}

// the end stops of hinges are soft and know nothing of coupled joints: at the limit of a joint the servo
// takes over until the command leads back
void Drives::watch_limits(const RobotBody& robot) {
  constexpr double kLookAhead_s = 0.004;
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    AxisState& state = axes_[a];
    state.at_limit = false;
    if (is_servo(state.measured.mode)) continue;
    const auto [position, velocity] = motion_of(a, robot);
    const JointInfo& info = axis_info_[a].info;
    const double push = state.measured.target;
    const double ahead = position + velocity * kLookAhead_s;
    state.at_limit = (ahead < info.min_rad && push <= 0) || (ahead > info.max_rad && push >= 0);
    state.reference_rad = std::clamp(position, info.min_rad, info.max_rad);
    state.previous_reference_rad = state.reference_rad;
    state.reference_velocity_rad_s = 0;
  }
}

void Drives::drive(double fraction, RobotBody& robot) {
  watch_limits(robot);
  // where gravity pulls at a hinge, weight that lags by a control period would feed a swing with energy
  const bool swings = robot.is_free() || std::any_of(axes_.begin(), axes_.end(), [](const AxisState& axis) {
                        return !is_servo(axis.measured.mode) || axis.fault == JointFault::kOff;
                      });
  if (swings) robot.gravity_torques(gravity_Nm_);
  for (std::size_t i = 1; i < hinges_.size(); ++i) {
    const Hinge& hinge = hinges_[i];
    if (robot.floats(i)) {
      robot.tree().set_base_force(i, gravity_Nm_[i]);
      continue;
    }
    robot.tree().set_top_speed(i, hinge.top_speed_rad_s);
    if (shares_a_fault(hinge)) {
      drive_shared(i, fraction, robot);
      continue;
    }
    double reference = hinge.offset_rad;
    double feedforward = 0;
    double torque = 0;
    bool servo = false;
    bool idle = true;
    bool is_stopped = true;
    JointFault fault = JointFault::kNone;
    for (const auto& [a, multiplier] : hinge.axes) {
      const AxisState& state = axes_[a];
      fault = std::max(fault, state.fault);
      const double now =
          state.previous_reference_rad + fraction * (state.reference_rad - state.previous_reference_rad);
      reference += multiplier * now;
      feedforward += multiplier * state.reference_velocity_rad_s;
      const JointMode mode = state.measured.mode;
      servo = servo || is_servo(mode) || state.at_limit;
      idle = idle && mode == JointMode::kIdle;
      is_stopped = is_stopped && is_braking(state);
      const double sign = multiplier < 0 ? -1 : 1;
      if (mode == JointMode::kTorque) torque += sign * state.measured.target;
      if (mode == JointMode::kPwm) torque += sign * state.measured.target * hinge.max_torque_Nm;
    }
    const auto motor = [&robot, i](double speed_rad_s, double most_torque_Nm) {
      robot.tree().set_motor(i, {speed_rad_s, most_torque_Nm});
    };
    if (fault == JointFault::kStuck) {
      motor(0, kStuckShare * hinge.max_torque_Nm);
      continue;
    }
    const double strength = fault == JointFault::kNone ? 1 : fault == JointFault::kWeak ? kWeakShare : 0;
    if (fault == JointFault::kOff) {
      servo = false;
      idle = true;
    }
    if (servo && is_stopped && fault == JointFault::kNone) {
      motor(0, spare_torque_Nm(hinge.max_torque_Nm, gravity_Nm_[i]));
      continue;
    }
    if (servo) {
      const double error = reference - robot.angle_rad(i);
      const double velocity = std::clamp(feedforward + hinge.gain_1_s * error, -hinge.max_velocity_rad_s,
                                         hinge.max_velocity_rad_s);
      // what the motor spends on gravity it does not have for the rest
      const double most = strength * hinge.max_torque_Nm;
      if (fault == JointFault::kWeak && std::abs(gravity_Nm_[i]) > most) {
        // it cannot bear the weight
        motor(std::copysign(hinge.max_velocity_rad_s, gravity_Nm_[i]), std::abs(gravity_Nm_[i]) - most);
        continue;
      }
      const double left = spare_torque_Nm(most, gravity_Nm_[i]);
      robot.tree().set_motor(i, {velocity, left, hinge.gain_1_s * kServoGive_rad});
      continue;
    }
    // without a servo gravity pulls at the hinge; a motor that wants the largest speed with just this torque
    // gives the torque below that speed and never more speed
    torque = strength * std::clamp(torque, -hinge.max_torque_Nm, hinge.max_torque_Nm) + gravity_Nm_[i];
    const double friction = (idle ? kIdleFriction : 0.2 * kIdleFriction) * hinge.max_torque_Nm;
    // friction works against the motion: it takes from a torque that drives and adds to one that brakes
    const double velocity = robot.velocity_rad_s(i);
    const bool brakes = std::abs(velocity) > kStandstill_rad_s && velocity * torque < 0;
    const double size = std::abs(torque);
    if (size > friction) {
      motor(std::copysign(hinge.max_velocity_rad_s, torque), brakes ? size + friction : size - friction);
    } else {
      const bool drives = velocity * torque > 0 && std::abs(velocity) > kStandstill_rad_s;
      motor(0, brakes ? friction + size : drives ? friction - size : friction);
    }
  }
}

bool Drives::still(std::size_t link, const RobotBody& robot) const {
  constexpr double kStill_rad = 2e-5;
  constexpr double kStill_rad_s = 1e-4;
  if (robot.floats(link)) return false;  // it stands only because its feet bear it
  const Hinge& hinge = hinges_[link];
  double reference = hinge.offset_rad;
  for (const auto& [a, multiplier] : hinge.axes) {
    const AxisState& state = axes_[a];
    if (!is_servo(state.measured.mode) || state.reference_rad != state.previous_reference_rad ||
        state.fault == JointFault::kOff || shares_a_fault(hinge))
      return false;
    reference += multiplier * state.reference_rad;
  }
  return std::abs(reference - robot.angle_rad(link)) < kStill_rad &&
         std::abs(robot.velocity_rad_s(link)) < kStill_rad_s;
}

void Drives::accumulate(const RobotBody& robot) {
  // the motor also bears gravity, which the solver does not see
  for (std::size_t i = 1; i < hinges_.size(); ++i)
    hinge_torque_Nm_[i] += robot.tree().motor_torque_Nm(i) - gravity_Nm_[i];
  ++steps_;
}

void Drives::measure(const RobotBody& robot) {
  if (steps_ > 0) {
    for (std::size_t i = 1; i < hinges_.size(); ++i) {
      // what is more came from an end stop, not from the motor
      hinge_torque_Nm_[i] =
          std::clamp(hinge_torque_Nm_[i] / steps_, -hinges_[i].max_torque_Nm, hinges_[i].max_torque_Nm);
    }
    steps_ = 0;
  }
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    JointState& state = axes_[a].measured;
    std::tie(state.position_rad, state.velocity_rad_s) = motion_of(a, robot);
    state.torque_Nm = 0;
    for (const Share& share : axis_info_[a].shares) {
      const double torque = (share.multiplier < 0 ? -1 : 1) * hinge_torque_Nm_[share.link];
      state.torque_Nm += torque / static_cast<double>(axis_info_[a].shares.size());
    }
    if (state.mode == JointMode::kPosition) {
      const Trajectory& path = axes_[a].trajectory;
      state.motion_done = static_cast<double>(path.age) * period_s_ >= path.duration_s - 1e-9 &&
                          std::abs(state.position_rad - state.target) < kDone_rad;
    }
  }
  publish();
}

void Drives::publish() {
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    const auto part = static_cast<std::size_t>(axis_info_[a].part);
    JointState& shown = measured_[part][a - first_axis_[part]];
    shown = axes_[a].measured;
    shown.home_rad = axis_info_[a].home_rad;
    shown.reference_rad = is_servo(shown.mode) ? axes_[a].reference_rad : shown.position_rad;
  }
}

void Drives::restore(const State& state) {
  axes_ = state.axes;
  set_hinge_gains();
  hinge_torque_Nm_ = state.applied_torque_Nm;
  steps_ = 0;
  publish();
}

}  // namespace nido::sim
