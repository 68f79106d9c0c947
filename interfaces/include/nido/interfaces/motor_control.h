#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nido/interfaces/control_mode.h"
#include "nido/interfaces/result.h"

namespace nido {

// Small interfaces of a control board, the device that drives the joints of one part of a robot.
//
// Rules for all of them
// - Joints are numbered from 0 in the part's order. Units: rad, rad/s, rad/s^2, N m, duty cycle; never
// degrees.
// - Command functions take a list of joints and as many values. They refuse, with kInvalidArgument and
// without any
//   change, unequal lengths, an index outside 0..axes()-1, an index named twice, and a value that is not
//   finite; they name the joint and the value. An empty list is accepted and does nothing.
// - Finite values beyond a limit are clamped to it, not refused.
// - A joint in mode fault refuses commands with kFailed.
// - A board on the far side of a network answers kTimeout or kNotFound when it cannot be reached, and streams
//   (direct, velocity, torque, pwm) without waiting for an answer.
// - All functions are thread-safe. None waits for a motion.

// What is measured at all joints at one moment.
struct JointReading {
  std::int64_t stamp_ns = 0;                // time of the measurement, of the robot's clock
  std::vector<double> position_rad;         // (axes)
  std::vector<double> velocity_rad_s;       // (axes)
  std::vector<double> acceleration_rad_s2;  // (axes), zero where the hardware does not measure it
  std::vector<double> torque_Nm;            // (axes), zero where the hardware does not measure it
};

class IAxisInfo {
 public:
  virtual ~IAxisInfo() = default;
  // Number of joints; never changes.
  [[nodiscard]] virtual int axes() const = 0;
  // Name of a joint, unique in the robot: "r_elbow". kInvalidArgument for a wrong index.
  [[nodiscard]] virtual Result<std::string> axis_name(int joint) const = 0;
};

class IEncodersTimed {
 public:
  virtual ~IEncodersTimed() = default;
  // The newest measurement. Never waits; a board on the far side fails with kTimeout before the first one has
  // come.
  [[nodiscard]] virtual Result<JointReading> read_joints() const = 0;
};

// What a joint may do. No command brings a joint beyond this.
struct JointLimits {
  double min_rad = 0;
  double max_rad = 0;
  double max_velocity_rad_s = 0;
  double max_torque_Nm = 0;
};

class IControlLimits {
 public:
  virtual ~IControlLimits() = default;
  // Limits in force (axes).
  [[nodiscard]] virtual Result<std::vector<JointLimits>> limits() const = 0;
};

class IControlMode {
 public:
  virtual ~IControlMode() = default;
  // Modes of all joints (axes).
  [[nodiscard]] virtual Result<std::vector<ControlMode>> control_modes() const = 0;
  // Switches joints to a mode. The joints hold where they are (position, direct), stand still (velocity), or
  // are left without torque (torque, pwm, idle) until a command comes. kInvalidArgument for kFault.
  virtual Status set_control_mode(std::span<const int> joints, ControlMode mode) = 0;
};

class IPositionControl {
 public:
  virtual ~IPositionControl() = default;
  // Starts smooth motions to targets, each with its joint's reference speed.
  virtual Status move_to(std::span<const int> joints, std::span<const double> target_rad) = 0;
  // Where joints are on their way to, in mode position (axes); elsewhere where they are.
  [[nodiscard]] virtual Result<std::vector<double>> target_positions() const = 0;
  // Speeds of the next motions, in rad/s; above zero, clamped to the velocity limit.
  virtual Status set_reference_speeds(std::span<const int> joints, std::span<const double> speed_rad_s) = 0;
  [[nodiscard]] virtual Result<std::vector<double>> reference_speeds() const = 0;
  // Accelerations of the next motions, in rad/s^2; above zero. kUnsupported where the trajectory is fixed by
  // its speed.
  virtual Status set_reference_accelerations(std::span<const int> joints,
                                             std::span<const double> acceleration_rad_s2) = 0;
  [[nodiscard]] virtual Result<std::vector<double>> reference_accelerations() const = 0;
  // For each joint whether its trajectory has ended (axes); true in other modes.
  [[nodiscard]] virtual Result<std::vector<bool>> motion_done() const = 0;
  // Ends motions of any mode: the joints stay where they are, in mode position.
  virtual Status stop(std::span<const int> joints) = 0;
};

class IPositionDirect {
 public:
  virtual ~IPositionDirect() = default;
  // Targets to be followed at once, at most with the velocity limit. Stream it: a joint whose command is
  // older than 100 ms of the robot's time stops where it is.
  virtual Status set_positions(std::span<const int> joints, std::span<const double> target_rad) = 0;
};

class IVelocityControl {
 public:
  virtual ~IVelocityControl() = default;
  // Speeds to be kept. Stream it: a joint whose command is older than 100 ms of the robot's time stops.
  virtual Status set_velocities(std::span<const int> joints, std::span<const double> velocity_rad_s) = 0;
};

class ITorqueControl {
 public:
  virtual ~ITorqueControl() = default;
  // Torques to be exerted. Stream it: a joint whose command is older than 100 ms of the robot's time is held
  // where it is, in mode position.
  virtual Status set_torques(std::span<const int> joints, std::span<const double> torque_Nm) = 0;
};

class IPwmControl {
 public:
  virtual ~IPwmControl() = default;
  // Duty cycles -1..1. Stream it: a joint whose command is older than 100 ms of the robot's time is held
  // where it is, in mode position.
  virtual Status set_duty_cycles(std::span<const int> joints, std::span<const double> duty_cycle) = 0;
};

}  // namespace nido
