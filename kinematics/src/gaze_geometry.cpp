#include "nido/kinematics/gaze_geometry.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nido {
namespace {

constexpr double kSmallestVergence_rad = std::numbers::pi / 180;
constexpr double kLargestVergence_rad = 3.0;
constexpr double kFurthestAside_rad = 1.5;
constexpr Eigen::Index kVergence = 5;

const Eigen::Isometry3d& eye_of(const GazeState& state, int eye) {
  return state.X_RootEyes[static_cast<std::size_t>(eye)];
}

}  // namespace

PinholeCamera eye_camera(const GazeBody& body) {
  return {body.focal_px,        body.focal_px, body.width_px / 2.0,
          body.height_px / 2.0, body.width_px, body.height_px};
}

std::optional<Eigen::Vector2d> pixel_of(const GazeBody& body, const GazeState& state, int eye,
                                        const Eigen::Vector3d& p_Root_m) {
  return eye_camera(body).project(eye_of(state, eye).inverse() * p_Root_m);
}

Ray sight_of(const GazeBody& body, const GazeState& state, int eye, const Eigen::Vector2d& px) {
  return ray_of_pixel(eye_camera(body), eye_of(state, eye), px);
}

Eigen::Vector3d angles_of(const GazeBody& body, const Eigen::Vector3d& p_Root_m) {
  const Eigen::Vector3d p_m = body.X_RootAhead.inverse() * p_Root_m;
  return {std::atan2(p_m.x(), p_m.z()), -std::atan2(p_m.y(), std::abs(p_m.z())),
          2 * std::atan2(body.baseline_m / 2, p_m.norm())};
}

double distance_of_vergence_m(const GazeBody& body, double vergence_rad) {
  return body.baseline_m / 2 /
         std::tan(std::clamp(vergence_rad, kSmallestVergence_rad, kLargestVergence_rad) / 2);
}

Result<Eigen::Vector3d> p_at_angles(const GazeBody& body, const GazeState& state, bool relative,
                                    const Eigen::Vector3d& angles_rad) {
  if (!angles_rad.allFinite()) return Error{ErrorCode::kInvalidArgument, "an angle is a finite number"};
  if (angles_rad.head<2>().cwiseAbs().maxCoeff() > kFurthestAside_rad) {
    return Error{ErrorCode::kFailed,
                 "neck and eyes cannot turn so far: to the side and up at most 85 degrees"};
  }
  Eigen::Isometry3d X_RootFrom = body.X_RootAhead;
  double vergence_rad = angles_rad.z();
  if (relative) {
    // the middle between the eyes as they look now
    const Eigen::Quaterniond left(state.X_RootEyes[0].linear());
    const Eigen::Quaterniond right(state.X_RootEyes[1].linear());
    X_RootFrom.linear() = left.slerp(0.5, right).toRotationMatrix();
    X_RootFrom.translation() = (state.X_RootEyes[0].translation() + state.X_RootEyes[1].translation()) / 2;
    vergence_rad += state.head_rad[kVergence];
  }
  // so that its azimuth and elevation are told as they were asked for
  const Eigen::Vector3d direction =
      Eigen::Vector3d(std::tan(angles_rad.x()), -std::tan(angles_rad.y()), 1).normalized();
  return Eigen::Vector3d(X_RootFrom * (distance_of_vergence_m(body, vergence_rad) * direction));
}

}  // namespace nido
