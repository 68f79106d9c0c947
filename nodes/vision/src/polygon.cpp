#include "nido/vision/polygon.h"

#include <algorithm>
#include <cmath>

namespace nido::vision {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

Polygon convex_hull(std::vector<Eigen::Vector2d> points) {
  if (points.size() < 3) return points;
  std::sort(points.begin(), points.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  // Andrew's monotone chain: the lower border from left to right, then the upper one back
  Polygon hull(2 * points.size());
  std::size_t n = 0;
  for (const auto& p : points) {
    while (n >= 2 && cross(hull[n - 1] - hull[n - 2], p - hull[n - 2]) <= 0) --n;
    hull[n++] = p;
  }
  const std::size_t lower = n + 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) {
    while (n >= lower && cross(hull[n - 1] - hull[n - 2], points[i] - hull[n - 2]) <= 0) --n;
    hull[n++] = points[i];
  }
  hull.resize(n - 1);
  return hull;
}

double area(const Polygon& polygon) {
  if (polygon.size() < 3) return 0;
  double twice = 0;
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    twice += cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
  }
  return std::abs(twice) / 2;
}

Eigen::Vector2d centroid(const Polygon& polygon) {
  Eigen::Vector2d weighted = Eigen::Vector2d::Zero();
  double twice = 0;
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const double t = cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
    weighted += t * (polygon[0] + polygon[i - 1] + polygon[i]) / 3;
    twice += t;
  }
  if (std::abs(twice) > 1e-9) return weighted / twice;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : polygon) mean += p;
  return mean / static_cast<double>(polygon.size());
}

Polygon intersection(const Polygon& a, const Polygon& b) {
  if (a.size() < 3 || b.size() < 3) return {};
  // Sutherland-Hodgman: cut a with every edge of b
  Polygon result = a;
  Polygon next;
  for (std::size_t i = 0; i < b.size() && !result.empty(); ++i) {
    const Eigen::Vector2d& origin = b[i];
    const Eigen::Vector2d edge = b[(i + 1) % b.size()] - origin;
    next.clear();
    for (std::size_t k = 0; k < result.size(); ++k) {
      const Eigen::Vector2d& p = result[k];
      const Eigen::Vector2d& q = result[(k + 1) % result.size()];
      const double dp = cross(edge, p - origin);
      const double dq = cross(edge, q - origin);
      if (dp >= 0) next.push_back(p);
      if ((dp >= 0) != (dq >= 0)) next.push_back(p + (q - p) * (dp / (dp - dq)));
    }
    result.swap(next);
  }
  return result;
}

double overlap(const Polygon& a, const Polygon& b) {
  const double both = area(intersection(a, b));
  const double either = area(a) + area(b) - both;
  return either > 0 ? both / either : 0;
}

Polygon grown(const Polygon& polygon, double px) {
  if (polygon.empty()) return polygon;
  const Eigen::Vector2d middle = centroid(polygon);
  Polygon result = polygon;
  for (auto& p : result) {
    const double distance = (p - middle).norm();
    if (distance > 1e-9) p += (p - middle) / distance * px;
  }
  return result;
}

Polygon image_rectangle(int width_px, int height_px) {
  const double w = width_px;
  const double h = height_px;
  return {{0, 0}, {w, 0}, {w, h}, {0, h}};
}

bool contains(const Polygon& polygon, const Eigen::Vector2d& point) {
  if (polygon.size() < 3) return false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    if (cross(polygon[(i + 1) % polygon.size()] - polygon[i], point - polygon[i]) < 0) return false;
  }
  return true;
}

}  // namespace nido::vision
