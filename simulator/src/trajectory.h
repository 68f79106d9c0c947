#pragma once

#include <array>
#include <cstdint>

namespace nido::sim {

// A quintic from a moving start to rest at the goal.
struct Trajectory {
  std::int64_t age = 0;  // control periods since the start: counted, so that a run has no absolute time in it
  double duration_s = 0;
  std::array<double, 6> coefficient{};  // of powers of the time since the start

  // Of minimum jerk.
  [[nodiscard]] static Trajectory to(double goal_rad, double start_rad, double start_rad_s,
                                     double duration_s);
  [[nodiscard]] double position(double time_s) const;  // by the time since the start
};

}  // namespace nido::sim
