#pragma once

#include <cstdint>

#include "nido/interfaces/result.h"

namespace nido {

// A device that moves on with time. The robot process calls it once a control period, from one thread, with
// times that never go back; devices that are driven by a clock or a thread of their own are not steppable.
class ISteppable {
 public:
  virtual ~ISteppable() = default;
  // Advances to a time of the robot's clock. A failure is one of the device itself (not of a command) and
  // ends the process.
  virtual Status step_to(std::int64_t now_ns) = 0;
};

}  // namespace nido
