#include "nido/reach/joint_path.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>

namespace nido::reach {
namespace {
constexpr double kPeakOfMinimumJerk = 1.875;  // largest speed of the law over its mean speed
constexpr double kSpacing_s = 0.01;           // between points, at full speed
constexpr double kRounding_s = 0.25;          // half width of a rounded corner, at full speed
}  // namespace

double minimum_jerk(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
}

JointPath::JointPath(const std::vector<Joints>& knots, const Joints& speed_limit, double min_duration_s) {
  if (knots.empty() || !(speed_limit.minCoeff() > 0.0)) {
    std::cerr << "bug: a joint path needs a knot and positive speed limits\n";
    std::abort();
  }
  // time at full speed from knot to knot
  std::vector<double> time{0.0};
  for (std::size_t i = 1; i < knots.size(); ++i) {
    time.push_back(time.back() + (knots[i] - knots[i - 1]).cwiseAbs().cwiseQuotient(speed_limit).maxCoeff());
  }
  const double total = time.back();
  const auto count = static_cast<std::size_t>(std::ceil(total / kSpacing_s)) + 1;
  std::vector<Joints> straight;
  straight.reserve(count);
  std::size_t leg = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = count == 1 ? 0.0 : total * static_cast<double>(i) / static_cast<double>(count - 1);
    while (leg + 2 < knots.size() && t > time[leg + 1]) ++leg;
    if (knots.size() == 1 || time[leg + 1] <= time[leg]) {
      straight.push_back(knots[std::min(leg + 1, knots.size() - 1)]);
      continue;
    }
    const double share = std::clamp((t - time[leg]) / (time[leg + 1] - time[leg]), 0.0, 1.0);
    straight.push_back(knots[leg] + share * (knots[leg + 1] - knots[leg]));
  }
  if (count == 1) straight.front() = knots.back();
  straight.front() = knots.size() > 1 && count > 1 ? knots.front() : straight.front();
  straight.back() = knots.back();
  // a mean over a window never moves faster than what it is a mean of; the window shrinks to nothing at both
  // ends
  const auto widest = static_cast<std::size_t>(kRounding_s / kSpacing_s);
  points_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t half = std::min({widest, i, count - 1 - i});
    Joints sum = Joints::Zero();
    for (std::size_t k = i - half; k <= i + half; ++k) sum += straight[k];
    points_[i] = sum / static_cast<double>(2 * half + 1);
  }
  full_speed_s_ = total;
  duration_s_ = std::max(min_duration_s, kPeakOfMinimumJerk * total);
}

Joints JointPath::at(double t_s) const {
  return duration_s_ <= 0.0 ? points_.back() : along(minimum_jerk(t_s / duration_s_));
}

Joints JointPath::along(double share) const {
  if (points_.size() == 1) return points_.back();
  const double at = std::clamp(share, 0.0, 1.0) * static_cast<double>(points_.size() - 1);
  const auto before = std::min(static_cast<std::size_t>(at), points_.size() - 2);
  return points_[before] + (at - static_cast<double>(before)) * (points_[before + 1] - points_[before]);
}

}  // namespace nido::reach
