#pragma once

#include <chrono>
#include <optional>

#include "nido/middleware/time.h"

namespace nido {

// Keeps simulated time at a rate of wall time: the owner of the clock waits here once a tick. Not
// thread-safe.
class Pacer {
 public:
  // rate: simulated seconds per wall second, > 0; none: as fast as possible, and wait() returns at once.
  explicit Pacer(std::optional<double> rate) : rate_(rate) {}
  // Sleeps until simulated time `now` is due. When the caller is late by more than 0.1 s of wall time the
  // lost time is given up, so that a pause is not followed by a race.
  void wait(Time now);
  // Starts counting anew: after a pause, or with another rate.
  void restart(std::optional<double> rate);

 private:
  std::optional<double> rate_;
  bool started_ = false;
  Time start_;
  std::chrono::steady_clock::time_point wall_start_;
};

}  // namespace nido
