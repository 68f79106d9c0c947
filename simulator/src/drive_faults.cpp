// Joints that are broken on purpose: Drives, as far as faults go.
#include <algorithm>
#include <cmath>

#include "drives.h"
#include "servo.h"

namespace nido::sim {

void Drives::set_fault(int part, int joint, JointFault fault) {
  AxisState& state = axes_[axis_index(part, joint)];
  state.fault = fault;
  state.held_rad = state.measured.position_rad;
}

bool Drives::shares_a_fault(const Hinge& hinge) const {
  return std::any_of(hinge.axes.begin(), hinge.axes.end(), [&](const auto& share) {
    return axes_[share.first].fault != axes_[hinge.axes.front().first].fault;
  });
}

// A servo's torque is proportional to how much speed is missing, so every joint of the hinge has its part of
// it; a faulty one asks for no more than it can.
void Drives::drive_shared(std::size_t link, double fraction, RobotBody& robot) {
  const Hinge& hinge = hinges_[link];
  const double give_way_rad_s = hinge.gain_1_s * kServoGive_rad;  // missing with all torque
  double speed = robot.velocity_rad_s(link);
  for (const auto& [a, multiplier] : hinge.axes) {
    const AxisState& state = axes_[a];
    if (state.fault == JointFault::kOff) continue;
    const auto [position, velocity] = motion_of(a, robot);
    double missing = -velocity;
    if (state.fault == JointFault::kStuck) {
      missing += hinge.gain_1_s * (state.held_rad - position);
    } else if (is_servo(state.measured.mode) || state.at_limit) {
      const double now =
          state.previous_reference_rad + fraction * (state.reference_rad - state.previous_reference_rad);
      missing += state.reference_velocity_rad_s + hinge.gain_1_s * (now - position);
    } else if (state.measured.mode == JointMode::kTorque) {
      missing = (multiplier < 0 ? -1 : 1) * state.measured.target / hinge.max_torque_Nm * give_way_rad_s;
    } else {
      missing = state.measured.mode == JointMode::kPwm ? state.measured.target * give_way_rad_s : 0;
    }
    if (state.fault == JointFault::kWeak)
      missing = std::clamp(missing, -kWeakShare * give_way_rad_s, kWeakShare * give_way_rad_s);
    speed += multiplier * missing;
  }
  const double left = std::max(hinge.max_torque_Nm - std::abs(gravity_Nm_[link]), 0.1 * hinge.max_torque_Nm);
  robot.tree().set_motor(
      link, {std::clamp(speed, -hinge.max_velocity_rad_s, hinge.max_velocity_rad_s), left, give_way_rad_s});
}

}  // namespace nido::sim
