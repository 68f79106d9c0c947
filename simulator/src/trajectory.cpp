#include "trajectory.h"

#include <algorithm>

namespace nido::sim {

Trajectory Trajectory::to(double goal_rad, double start_rad, double start_rad_s, double duration_s) {
  const double T = duration_s;
  const double h = goal_rad - start_rad;
  const double v0 = start_rad_s;
  Trajectory path;
  path.duration_s = T;
  path.coefficient = {start_rad,
                      v0,
                      0,
                      (20 * h - 12 * v0 * T) / (2 * T * T * T),
                      (-30 * h + 16 * v0 * T) / (2 * T * T * T * T),
                      (12 * h - 6 * v0 * T) / (2 * T * T * T * T * T)};
  return path;
}

double Trajectory::position(double time_s) const {
  const double t = std::clamp(time_s, 0.0, duration_s);
  double sum = 0;
  for (int i = 5; i >= 0; --i) sum = sum * t + coefficient[i];
  return sum;
}

}  // namespace nido::sim
