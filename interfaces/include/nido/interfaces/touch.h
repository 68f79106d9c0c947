#pragma once

#include <cstdint>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// What touches a hand or a patch of skin. Pads of a hand: thumb, index, middle, ring, little finger tip,
// palm. Of a patch: one a value of the robot's skin port (docs/skin.md), also those that no taxel stands for.
struct TouchReading {
  std::int64_t stamp_ns = 0;    // time of the measurement, of the robot's clock
  std::vector<bool> on;         // (pads) contact with anything that is not the robot
  std::vector<double> force_N;  // (pads) sum of the normal contact forces, never negative
};

// Touch pads of a hand, or the taxels of a patch of skin. Thread-safe.
class ITouch {
 public:
  virtual ~ITouch() = default;
  // Number of pads; never changes. Six for a hand, 384 or 768 for the patches of an iCub.
  [[nodiscard]] virtual int pads() const = 0;
  // The newest measurement. Never waits; kTimeout on the far side before the first one has come.
  [[nodiscard]] virtual Result<TouchReading> read_touch() const = 0;
};

}  // namespace nido
