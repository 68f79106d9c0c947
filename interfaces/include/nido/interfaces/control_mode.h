#pragma once

#include <optional>
#include <string_view>

namespace nido {

// How one joint's motor is driven. Every command function of a control board switches the joints that it
// addresses to its own mode, so that a client that streams commands needs no second conversation.
enum class ControlMode {
  kIdle,      // motor off
  kPosition,  // a smooth trajectory to a target, with the reference speed of the joint
  kDirect,    // follows a target at once, at most with the velocity limit; needs a new command every 100 ms
  kVelocity,  // keeps a speed; needs a new command every 100 ms
  kTorque,    // exerts a torque; needs a new command every 100 ms
  kPwm,       // a duty cycle -1..1 of what the motor can do; needs a new command every 100 ms
  kFault,     // the hardware has failed: the joint takes no command until it is repaired
};

// The words of messages and logs: "idle", "position", "direct", "velocity", "torque", "pwm", "fault".
[[nodiscard]] constexpr std::string_view to_string(ControlMode mode) {
  switch (mode) {
    case ControlMode::kIdle:
      return "idle";
    case ControlMode::kPosition:
      return "position";
    case ControlMode::kDirect:
      return "direct";
    case ControlMode::kVelocity:
      return "velocity";
    case ControlMode::kTorque:
      return "torque";
    case ControlMode::kPwm:
      return "pwm";
    case ControlMode::kFault:
      return "fault";
  }
  return "unknown";
}

// The inverse; nothing for any other word.
[[nodiscard]] constexpr std::optional<ControlMode> control_mode_from_string(std::string_view word) {
  for (const ControlMode mode :
       {ControlMode::kIdle, ControlMode::kPosition, ControlMode::kDirect, ControlMode::kVelocity,
        ControlMode::kTorque, ControlMode::kPwm, ControlMode::kFault}) {
    if (word == to_string(mode)) return mode;
  }
  return std::nullopt;
}

}  // namespace nido
