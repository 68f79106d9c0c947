#pragma once

#include <string>

#include "nido/interfaces/result.h"

namespace nido {

// Ears in a room where somebody can be made to speak while they listen. Thread-safe.
class ISpokenTo {
 public:
  virtual ~ISpokenTo() = default;
  // Says a text of 1 to 200 characters, after what is being said. Returns when it begins, s of the robot's
  // clock. May block for the time that a synthetic voice needs. kFailed when nobody listens yet or more than
  // 20 s would wait.
  virtual Result<double> say(const std::string& text) = 0;
};

}  // namespace nido
