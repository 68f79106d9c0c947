#pragma once

#include <vector>

#include "nido/reach/arm_chain.h"

namespace nido::reach {

// A way through joint space and when to be where: rest to rest with a minimum-jerk time law, no joint ever
// faster than its speed limit. A value, thread-compatible.
class JointPath {
 public:
  JointPath() = default;
  // Through `knots` in order (at least one), straight in joint space between them. Corners are rounded, the
  // first and last knot are met exactly. speed_limit: rad/s a joint, all positive. The way takes at least
  // `min_duration_s`.
  JointPath(const std::vector<Joints>& knots, const Joints& speed_limit, double min_duration_s = 0.0);

  [[nodiscard]] double duration_s() const { return duration_s_; }
  [[nodiscard]] Joints at(double t_s) const;  // clamped to start and end
  // The posture after this share of the way, 0..1 (clamped), for another time law: even in time at full
  // speed.
  [[nodiscard]] Joints along(double share) const;
  // How long the way takes with some joint at its speed limit all the time.
  [[nodiscard]] double full_speed_s() const { return full_speed_s_; }
  [[nodiscard]] const Joints& start() const { return points_.front(); }
  [[nodiscard]] const Joints& end() const { return points_.back(); }
  // Evenly spread postures of the way, for checks of what is in it.
  [[nodiscard]] const std::vector<Joints>& points() const { return points_; }

 private:
  std::vector<Joints> points_;  // evenly spaced in time at full speed
  double full_speed_s_ = 0.0;
  double duration_s_ = 0.0;
};

// Share of the way after share `x` of the time, both 0..1: rest to rest with the least jerk (Flash & Hogan
// 1985).
double minimum_jerk(double x);

}  // namespace nido::reach
