#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// Small interfaces of what lies under the joints of a control board: motors, amplifiers, loops of the
// firmware, calibration. The rules of motor_control.h hold: joints are numbered from 0, lists are refused
// whole, everything is thread-safe, nothing waits for a motion. What the hardware does not have is
// kUnsupported; over a network it is kFailed with the reason.

// What is measured at all motors at one moment. A list is empty when the hardware does not measure it.
struct MotorReading {
  std::int64_t stamp_ns = 0;  // of the robot's clock
  // (axes) at the joint's side of the gear, coupled joints apart: where nothing is coupled, as the joint
  std::vector<double> position_rad;
  std::vector<double> velocity_rad_s;
  std::vector<double> acceleration_rad_s2;
  std::vector<double> duty_cycle;     // -1..1, of what the motor can do
  std::vector<double> current_A;      // signed as the torque
  std::vector<double> temperature_C;  // of the windings
};

class IMotorEncoders {
 public:
  virtual ~IMotorEncoders() = default;
  [[nodiscard]] virtual Result<MotorReading> read_motors() const = 0;
};

class IAmplifiers {
 public:
  virtual ~IAmplifiers() = default;
  // (axes) whether the amplifier drives its motor: false in modes idle and fault.
  [[nodiscard]] virtual Result<std::vector<bool>> amplifiers_on() const = 0;
};

// Which loop of the firmware.
enum class PidLoop { kPosition, kVelocity, kTorque, kCurrent };
// "pos", "vel", "trq", "cur": the words of the text protocol.
[[nodiscard]] constexpr std::string_view to_word(PidLoop loop) {
  switch (loop) {
    case PidLoop::kPosition:
      return "pos";
    case PidLoop::kVelocity:
      return "vel";
    case PidLoop::kTorque:
      return "trq";
    case PidLoop::kCurrent:
      return "cur";
  }
  return "pos";
}
[[nodiscard]] constexpr std::optional<PidLoop> pid_loop_from_word(std::string_view word) {
  for (const PidLoop loop : {PidLoop::kPosition, PidLoop::kVelocity, PidLoop::kTorque, PidLoop::kCurrent}) {
    if (word == to_word(loop)) return loop;
  }
  return std::nullopt;
}

// Gains of one joint's loop, in the units of its firmware, in YARP's order. On this project's simulated
// joints the position loop gives a speed for an error: kp in 1/s, and nothing else counts.
struct Pid {
  double kp = 0;
  double kd = 0;
  double ki = 0;
  double max_integral = 0;
  double max_output = 0;
  double offset = 0;
  double scale = 0;
  double stiction_up = 0;
  double stiction_down = 0;
  double kff = 0;
  friend bool operator==(const Pid&, const Pid&) = default;
};

// What a loop is doing. Position and velocity in rad and rad/s, torque in N m, current in A.
struct PidReading {
  std::vector<double> reference;  // (axes) where the joint is wanted now
  std::vector<double> error;      // (axes) reference minus measured
  std::vector<double> output;     // (axes) in the units of the firmware; here the duty cycle
};

class IPid {
 public:
  virtual ~IPid() = default;
  // (axes) gains in force. kUnsupported for a loop that the hardware does not have.
  [[nodiscard]] virtual Result<std::vector<Pid>> pids(PidLoop loop) const = 0;
  // Refuses, with kInvalidArgument and no change, gains that are not finite or below zero (offset and
  // stictions may be) or that the hardware cannot have.
  virtual Status set_pids(PidLoop loop, std::span<const int> joints, std::span<const Pid> pids) = 0;
  [[nodiscard]] virtual Result<PidReading> read_pids(PidLoop loop) const = 0;
};

// How a joint answers to being pushed.
enum class InteractionMode {
  kStiff,      // holds its position
  kCompliant,  // gives way as a spring with its impedance
};
// "stif", "comp".
[[nodiscard]] constexpr std::string_view to_word(InteractionMode mode) {
  return mode == InteractionMode::kStiff ? "stif" : "comp";
}

// A compliant joint is a spring and a damper, and an offset that bears what always pulls.
struct Impedance {
  double stiffness_Nm_rad = 0;
  double damping_Nms_rad = 0;
  double offset_Nm = 0;
  friend bool operator==(const Impedance&, const Impedance&) = default;
};

class IInteraction {
 public:
  virtual ~IInteraction() = default;
  [[nodiscard]] virtual Result<std::vector<InteractionMode>> interaction_modes() const = 0;  // (axes)
  virtual Status set_interaction_mode(std::span<const int> joints, InteractionMode mode) = 0;
  [[nodiscard]] virtual Result<std::vector<Impedance>> impedances() const = 0;  // (axes)
  // Refuses stiffness and damping below zero and what is not finite.
  virtual Status set_impedances(std::span<const int> joints, std::span<const Impedance> impedances) = 0;
};

class ICalibration {
 public:
  virtual ~ICalibration() = default;
  // Begins to look for the encoders' zeros. Nothing to do where encoders are absolute.
  virtual Status calibrate(std::span<const int> joints) = 0;
  [[nodiscard]] virtual Result<std::vector<bool>> calibrated() const = 0;  // (axes)
  // Starts smooth motions, with the reference speeds, to the posture that the robot begins with.
  virtual Status home(std::span<const int> joints) = 0;
};

// Settings that only one kind of board has, as text.
class IRemoteVariables {
 public:
  virtual ~IRemoteVariables() = default;
  [[nodiscard]] virtual Result<std::vector<std::string>> variable_names() const = 0;
  // kNotFound for a name that is not in the list.
  [[nodiscard]] virtual Result<std::string> variable(const std::string& name) const = 0;
  // kInvalidArgument, and no change, for a value that the board cannot take.
  virtual Status set_variable(const std::string& name, const std::string& value) = 0;
};

class IMotors : public IMotorEncoders,
                public IAmplifiers,
                public IPid,
                public IInteraction,
                public ICalibration,
                public IRemoteVariables {};

}  // namespace nido
