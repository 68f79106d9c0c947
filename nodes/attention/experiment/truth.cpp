#include "truth.h"

#include <cmath>
#include <limits>

namespace nido::attention {
namespace {

constexpr double kMiss = std::numeric_limits<double>::infinity();

// How far along a ray (in the thing's frame) its surface lies.
double hit_box(const Eigen::Vector3d& o, const Eigen::Vector3d& d, const Eigen::Vector3d& half_m) {
  double from = 0;
  double to = kMiss;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(d[i]) < 1e-12) {
      if (std::abs(o[i]) > half_m[i]) return kMiss;
      continue;
    }
    const double a = (-half_m[i] - o[i]) / d[i];
    const double b = (half_m[i] - o[i]) / d[i];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return from <= to ? from : kMiss;
}

// Smaller root of a t^2 + 2 b t + c.
double first_root(double a, double b, double c) {
  const double square = b * b - a * c;
  return square < 0 || a < 1e-12 ? kMiss : (-b - std::sqrt(square)) / a;
}

double hit(const Thing& thing, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
  if (thing.shape == Thing::Shape::kBox) return hit_box(o, d, thing.size_m / 2);
  const double r = thing.size_m.x();
  if (thing.shape == Thing::Shape::kBall)
    return first_root(d.squaredNorm(), o.dot(d), o.squaredNorm() - r * r);
  const double half_m = thing.size_m.y() / 2;
  const double side =
      first_root(d.head<2>().squaredNorm(), o.head<2>().dot(d.head<2>()), o.head<2>().squaredNorm() - r * r);
  double nearest = kMiss;
  if (side < kMiss && side > 0 && std::abs(o.z() + side * d.z()) <= half_m) nearest = side;
  for (const double z : {-half_m, half_m}) {
    if (std::abs(d.z()) < 1e-12) continue;
    const double t = (z - o.z()) / d.z();
    if (t > 0 && (o + t * d).head<2>().norm() <= r) nearest = std::min(nearest, t);
  }
  return nearest;
}

}  // namespace

std::vector<std::uint8_t> silhouette(const PinholeCamera& camera, const Eigen::Isometry3d& X_RootCamera,
                                     const std::vector<Placed>& placed) {
  std::vector<std::uint8_t> mask(
      static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px), 0);
  std::vector<Eigen::Isometry3d> X_ThingCamera;
  for (const Placed& p : placed) X_ThingCamera.push_back(p.X_RootThing.inverse() * X_RootCamera);
  const auto along = [&](std::size_t i, const Eigen::Vector3d& ray) {
    return hit(things()[static_cast<std::size_t>(placed[i].thing)], X_ThingCamera[i].translation(),
               X_ThingCamera[i].linear() * ray);
  };
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const Eigen::Vector3d ray = camera.ray_Camera({x + 0.5, y + 0.5});
      const double first = placed.empty() ? kMiss : along(0, ray);
      if (first == kMiss) continue;
      bool seen = true;
      for (std::size_t i = 1; i < placed.size() && seen; ++i) seen = along(i, ray) >= first;
      if (seen)
        mask[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width_px) +
             static_cast<std::size_t>(x)] = 255;
    }
  }
  return mask;
}

double intersection_over_union(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  long both = 0;
  long any = 0;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    both += a[i] != 0 && b[i] != 0 ? 1 : 0;
    any += a[i] != 0 || b[i] != 0 ? 1 : 0;
  }
  return any > 0 ? static_cast<double>(both) / static_cast<double>(any) : 0.0;
}

}  // namespace nido::attention
