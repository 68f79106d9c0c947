#pragma once

#include <chrono>
#include <optional>

#include "nido/middleware/time.h"

namespace nido {

// Keeps simulated time at a rate of wall time: the owner of the clock asks once a tick. Not thread-safe.
class Pacer {
 public:
  // rate: simulated seconds per wall second, > 0; none: as fast as possible, nothing is waited for.
  explicit Pacer(std::optional<double> rate) : rate_(rate) {}
  // When simulated time `now` is due; none: at once. When the caller is late by more than 0.1 s of wall time
  // the lost time is given up, so that a pause is not followed by a race.
  std::optional<std::chrono::steady_clock::time_point> due(Time now);
  // Starts counting anew: after a pause, or with another rate.
  void restart(std::optional<double> rate);

 private:
  std::optional<double> rate_;
  bool started_ = false;
  Time start_;
  std::chrono::steady_clock::time_point wall_start_;
};

}  // namespace nido
