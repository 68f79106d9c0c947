#include "nido/attention/background.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace nido::attention {
namespace {

constexpr double kInlier = 0.8;       // plane numbers
constexpr double kBehind = 0.8;       // plane numbers between the background and the surface's middle
constexpr double kFewestShare = 0.4;  // of the sure pixels
constexpr std::size_t kFewest = 40;
constexpr int kDraws = 80;

}  // namespace

cv::Mat sure_planes(const PlaneSweep& planes, double margin) {
  cv::Mat sure(planes.roi.size(), CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  const std::size_t count = planes.costs.size();
  std::vector<const float*> rows(count);
  for (int y = 0; y < sure.rows; ++y) {
    for (std::size_t k = 0; k < count; ++k) rows[k] = planes.costs[k].ptr<float>(y);
    for (int x = 0; x < sure.cols; ++x) {
      std::size_t best = 0;
      for (std::size_t k = 1; k < count; ++k) {
        if (rows[k][x] < rows[best][x]) best = k;
      }
      float other = kCostLimit;
      for (std::size_t k = 0; k < count; ++k) {
        if (k + 2 < best || k > best + 2) other = std::min(other, rows[k][x]);
      }
      if (other - rows[best][x] < margin) continue;
      sure.at<float>(y, x) = static_cast<float>(planes.first + static_cast<int>(best));
    }
  }
  return sure;
}

std::optional<Background> find_background(const cv::Mat& sure, const cv::Mat& outside,
                                          const Eigen::Vector2d& surface_px, double surface_plane) {
  std::vector<Eigen::Vector3d> points;  // x, y, plane
  for (int y = 0; y < sure.rows; ++y) {
    for (int x = 0; x < sure.cols; ++x) {
      if (outside.at<std::uint8_t>(y, x) != 0 && std::isfinite(sure.at<float>(y, x)))
        points.emplace_back(x, y, sure.at<float>(y, x));
    }
  }
  if (points.size() < kFewest) return std::nullopt;
  std::mt19937 random(1);  // the same draws for the same picture
  const auto draw = [&] { return points[random() % points.size()]; };
  const auto fits = [](const Background& b, const Eigen::Vector3d& p) {
    return std::abs(b.plane(p.x(), p.y()) - p.z()) < kInlier;
  };
  Background best;
  std::size_t most = 0;
  for (int i = 0; i < kDraws; ++i) {
    Eigen::Matrix3d A;
    Eigen::Vector3d b;
    for (int r = 0; r < 3; ++r) {
      const Eigen::Vector3d p = draw();
      A.row(r) << p.x(), p.y(), 1;
      b[r] = p.z();
    }
    if (std::abs(A.determinant()) < 50) continue;  // nearly on a line
    const Eigen::Vector3d c = A.partialPivLu().solve(b);
    const Background candidate{c.x(), c.y(), c.z()};
    if (candidate.plane(surface_px.x(), surface_px.y()) > surface_plane - kBehind) continue;  // not behind it
    std::size_t count = 0;
    for (const auto& p : points) count += fits(candidate, p) ? 1 : 0;
    if (count > most) {
      most = count;
      best = candidate;
    }
  }
  if (static_cast<double>(most) < kFewestShare * static_cast<double>(points.size())) return std::nullopt;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-6;
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const auto& p : points) {
    if (!fits(best, p)) continue;
    const Eigen::Vector3d row(p.x(), p.y(), 1);
    normal += row * row.transpose();
    right += row * p.z();
  }
  const Eigen::Vector3d c = normal.ldlt().solve(right);
  return Background{c.x(), c.y(), c.z()};
}

}  // namespace nido::attention
