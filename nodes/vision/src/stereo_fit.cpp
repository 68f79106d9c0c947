#include "nido/vision/stereo_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace nido::vision {
namespace {

// Moves the body until the centres of its outlines lie where the seen ones do: Gauss-Newton on both images.
bool match_centres(const Body& body, const EyePair& eyes, const OutlinePair& seen, int steps, Fit& fit) {
  for (int step = 0; step < steps; ++step) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
    for (std::size_t e = 0; e < 2; ++e) {
      const EyeView& eye = eyes[e];
      const Polygon outline = body.outline(eye, fit.p_Root_m, fit.yaw_rad);
      if (outline.size() < 3) return false;
      const Eigen::Vector2d residual = centroid(seen[e]) - centroid(outline);
      const Eigen::Vector3d p = eye.X_RootCamera.inverse() * fit.p_Root_m;
      Eigen::Matrix<double, 2, 3> J;
      J << eye.camera.fx_px / p.z(), 0, -eye.camera.fx_px * p.x() / (p.z() * p.z()), 0,
          eye.camera.fy_px / p.z(), -eye.camera.fy_px * p.y() / (p.z() * p.z());
      J = J * eye.X_RootCamera.linear().transpose();
      normal += J.transpose() * J;
      right_side += J.transpose() * residual;
    }
    const Eigen::Vector3d move = normal.ldlt().solve(right_side);
    if (!move.allFinite() || move.norm() > 0.5) return false;
    fit.p_Root_m += move;
    if (move.norm() < 1e-5) break;
  }
  return true;
}

double wrapped(double yaw_rad, double period_rad) {
  return yaw_rad - period_rad * std::round(yaw_rad / period_rad);
}

}  // namespace

std::optional<Eigen::Vector3d> meet(const EyePair& eyes, const Eigen::Vector2d& left_px,
                                    const Eigen::Vector2d& right_px, double max_gap_m) {
  const auto met = triangulate(ray_of_pixel(eyes[0].camera, eyes[0].X_RootCamera, left_px),
                               ray_of_pixel(eyes[1].camera, eyes[1].X_RootCamera, right_px));
  if (!met || met->gap_m > max_gap_m) return std::nullopt;
  return met->p_m;
}

double pose_overlap(const Body& body, const EyePair& eyes, const OutlinePair& seen,
                    const Eigen::Vector3d& p_Root_m, double yaw_rad) {
  double sum = 0;
  for (std::size_t e = 0; e < 2; ++e) sum += overlap(body.outline(eyes[e], p_Root_m, yaw_rad), seen[e]);
  return sum / 2;
}

std::optional<Fit> fit_body(const Body& body, const EyePair& eyes, const OutlinePair& seen, const Fit& start,
                            bool search_yaw) {
  if (seen[0].size() < 3 || seen[1].size() < 3) return std::nullopt;
  Fit best = start;
  if (!match_centres(body, eyes, seen, 5, best)) return std::nullopt;
  best.overlap = pose_overlap(body, eyes, seen, best.p_Root_m, best.yaw_rad);
  if (body.symmetry_rad <= 0) {
    best.yaw_rad = 0;
    return best;
  }
  const auto attempt = [&](double yaw) {
    Fit fit = best;
    fit.yaw_rad = yaw;
    if (!match_centres(body, eyes, seen, 1, fit)) return;
    fit.overlap = pose_overlap(body, eyes, seen, fit.p_Root_m, yaw);
    if (fit.overlap > best.overlap) best = fit;
  };
  constexpr int kCoarse = 12;
  double step = body.symmetry_rad / kCoarse;
  if (search_yaw) {
    const double first = best.yaw_rad;
    for (int i = 1; i < kCoarse; ++i) attempt(first + i * step);
  } else {
    step /= 2;
  }
  for (step /= 2; step > 0.004; step /= 2) {
    const double middle = best.yaw_rad;
    attempt(middle - step);
    attempt(middle + step);
  }
  best.yaw_rad = wrapped(best.yaw_rad, body.symmetry_rad);
  return best;
}

}  // namespace nido::vision
