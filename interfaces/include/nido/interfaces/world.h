#pragma once

#include <string>

namespace nido {

// The world around a simulated robot, by lines of text. Thread-safe.
class IWorld {
 public:
  virtual ~IWorld() = default;
  // One line of the vocabulary (docs/world.md), one line of answer: "[ok]", values, or `[fail] "reason"`. A
  // refused line changes nothing.
  virtual std::string command(const std::string& line) = 0;
};

}  // namespace nido
