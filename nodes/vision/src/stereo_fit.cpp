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
      const Polygon outline = body.outline(eye, fit.p_Root_m, fit.R_RootBody());
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

double pose_overlap(const Body& body, const EyePair& eyes, const OutlinePair& seen, const Fit& pose) {
  double sum = 0;
  for (std::size_t e = 0; e < 2; ++e) {
    sum += overlap(body.outline(eyes[e], pose.p_Root_m, pose.R_RootBody()), seen[e]);
  }
  return sum / 2;
}

namespace {

// The better of `best` and a body turned differently there.
void attempt(const Body& body, const EyePair& eyes, const OutlinePair& seen, double yaw_rad,
             const Eigen::Matrix3d& tilt, Fit& best) {
  Fit fit = best;
  fit.yaw_rad = yaw_rad;
  fit.tilt = tilt;
  if (!match_centres(body, eyes, seen, 1, fit)) return;
  fit.overlap = pose_overlap(body, eyes, seen, fit);
  if (fit.overlap > best.overlap) best = fit;
}

void turn_upright(const Body& body, const EyePair& eyes, const OutlinePair& seen, bool search_yaw,
                  Fit& best) {
  const Eigen::Matrix3d none = Eigen::Matrix3d::Identity();
  constexpr int kCoarse = 12;
  double step = body.symmetry_rad / kCoarse;
  if (search_yaw) {
    const double first = best.yaw_rad;
    for (int i = 1; i < kCoarse; ++i) attempt(body, eyes, seen, first + i * step, none, best);
  } else {
    step /= 2;
  }
  for (step /= 2; step > 0.004; step /= 2) {
    const double middle = best.yaw_rad;
    attempt(body, eyes, seen, middle - step, none, best);
    attempt(body, eyes, seen, middle + step, none, best);
  }
}

void lean(const Body& body, const EyePair& eyes, const OutlinePair& seen, bool search, Fit& best) {
  if (search) {
    const double yaw = best.yaw_rad;
    for (int direction = 0; direction < 12; ++direction) {
      const double angle = direction * M_PI / 6;
      const Eigen::Vector3d axis(std::cos(angle), std::sin(angle), 0);
      for (const double by_rad : {0.35, 0.75}) {
        attempt(body, eyes, seen, yaw, Eigen::AngleAxisd(by_rad, axis).toRotationMatrix(), best);
      }
    }
  }
  for (double step = search ? 0.32 : 0.08; step > 0.019; step /= 2) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        const Eigen::AngleAxisd turn(sign * step, Eigen::Vector3d::Unit(axis));
        attempt(body, eyes, seen, best.yaw_rad, turn * best.tilt, best);
      }
    }
  }
}

}  // namespace

std::optional<Fit> fit_body(const Body& body, const EyePair& eyes, const OutlinePair& seen, const Fit& start,
                            bool search_yaw) {
  constexpr double kUprightIsFine = 0.955;   // overlap beyond which nobody asks whether the body leans
  constexpr double kLeaningIsBetter = 0.02;  // gain in overlap that makes a leaning pose believed
  if (seen[0].size() < 3 || seen[1].size() < 3) return std::nullopt;
  Fit best = start;
  best.tilt = Eigen::Matrix3d::Identity();
  if (!match_centres(body, eyes, seen, 5, best)) return std::nullopt;
  best.overlap = pose_overlap(body, eyes, seen, best);
  if (body.symmetry_rad <= 0) {
    best.yaw_rad = 0;
    return best;
  }
  turn_upright(body, eyes, seen, search_yaw, best);
  if (best.overlap < kUprightIsFine) {
    Fit leaning = best;
    const bool leaned = !start.tilt.isIdentity(1e-6);
    if (leaned) attempt(body, eyes, seen, start.yaw_rad, start.tilt, leaning);
    lean(body, eyes, seen, search_yaw || !leaned, leaning);
    if (leaning.overlap > best.overlap + kLeaningIsBetter) return leaning;
  }
  best.yaw_rad = wrapped(best.yaw_rad, body.symmetry_rad);
  return best;
}

}  // namespace nido::vision
