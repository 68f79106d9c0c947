#pragma once

#include <string>
#include <vector>

namespace nido::sim {

// How a joint's motor is driven.
enum class JointMode {
  kIdle,      // motor off: the joint moves freely but for friction and its limits
  kPosition,  // minimum-jerk trajectory to the target with the joint's reference speed
  kDirect,  // the target is followed at once, at most with the velocity limit; stream it every control period
  kVelocity,  // the target is a velocity; stops at the position limits
  kTorque,    // the target is a torque on top of the compensated friction; gravity is not compensated
  kPwm,       // the target is a duty cycle -1..1 of the maximum torque
};

// "idle", "position", "direct", "velocity", "torque", "pwm".
[[nodiscard]] const char* to_string(JointMode mode);

// What is fixed about one joint of a part, as clients see it. A joint may drive several hinges: eyes_version
// and eyes_vergence drive both eyes' pans, a distal finger joint two hinges of half its angle.
struct JointInfo {
  std::string name;    // "r_elbow"
  double min_rad = 0;  // position limits
  double max_rad = 0;
  double max_velocity_rad_s = 0;   // no mode moves the joint faster on purpose
  double max_torque_Nm = 0;        // no mode pushes harder; for coupled joints per hinge
  double default_speed_rad_s = 0;  // reference speed of position mode after a reset
};

// One control board. Parts are in the order head, torso, left_arm, right_arm, left_leg, right_leg.
struct PartInfo {
  std::string name;
  std::vector<JointInfo> joints;  // the iCub's order: head 6, torso 3 (yaw, roll, pitch), arms 16, legs 6
};

// What is measured at one joint at the end of the last control period.
struct JointState {
  double position_rad = 0;
  double velocity_rad_s = 0;
  double torque_Nm = 0;  // what the motor exerted about the hinge, mean over the last control period
  double target = 0;     // last accepted target of its mode: rad, rad/s, N m or duty cycle
  double reference_speed_rad_s = 0;  // of position mode
  double reference_rad = 0;          // where the servo wants it now; where it is when no servo drives it
  double servo_gain_1_s = 0;         // speed that the servo asks for, by error
  double home_rad = 0;               // of the posture that a reset brings
  JointMode mode = JointMode::kPosition;
  bool motion_done = true;  // position mode: the trajectory has ended and the joint is within 1 degree of it
};

}  // namespace nido::sim
