#pragma once

#include <vector>

#include "nido/interfaces/control_mode.h"
#include "nido/interfaces/result.h"

namespace nido {

// What only some control boards can tell or do. Ask a board for it with dynamic_cast; the limits layer and
// what lies above it have all of them, whatever is below. The rules of motor_control.h hold.

class ICommanded {
 public:
  virtual ~ICommanded() = default;
  // (axes) what the joints are streamed in a mode, clamped to the limits: rad (direct), rad/s (velocity), N m
  // (torque), -1..1 (pwm). Of joints in another mode: 0, and for direct where their motion goes to.
  [[nodiscard]] virtual Result<std::vector<double>> commanded(ControlMode mode) const = 0;
};

class ILimitSettings {
 public:
  virtual ~ILimitSettings() = default;
  // Sets where a joint may be commanded to, within what its device can. Values beyond that are clamped to it.
  // kInvalidArgument, and no change, when min is not below max. A joint that stands beyond its new limits
  // stays there until it is commanded.
  virtual Status set_position_limits(int joint, double min_rad, double max_rad) = 0;
  // The same for its top speed, which is above zero.
  virtual Status set_velocity_limit(int joint, double max_rad_s) = 0;
};

class ICurrentRange {
 public:
  virtual ~ICurrentRange() = default;
  // (axes) greatest current of each motor, A, in both directions; kUnsupported where it is not known.
  [[nodiscard]] virtual Result<std::vector<double>> greatest_currents() const = 0;
};

}  // namespace nido
