#include "nido/vision/body.h"

#include <cmath>

namespace nido::vision {
namespace {

constexpr int kCorners = 16;  // of the polygons that stand for circles

// Adds the projected points; false if one lies behind the eye.
bool add_projected(const EyeView& eye, const Eigen::Isometry3d& X_CameraRoot, const Eigen::Vector3d& p_Root_m,
                   std::vector<Eigen::Vector2d>& out) {
  const auto px = eye.camera.project(X_CameraRoot * p_Root_m);
  if (!px) return false;
  out.push_back(*px);
  return true;
}

// Points of a circle, pushed out so that the polygon through them has the circle's area.
template <class AddPoint>
bool circle(const Eigen::Vector3d& centre, const Eigen::Vector3d& u, const Eigen::Vector3d& v, double radius,
            AddPoint add) {
  const double step = 2 * M_PI / kCorners;
  const double r = radius * std::sqrt(step / std::sin(step));
  for (int i = 0; i < kCorners; ++i) {
    if (!add(centre + r * (std::cos(i * step) * u + std::sin(i * step) * v))) return false;
  }
  return true;
}

}  // namespace

Eigen::Vector3d Body::extents_m() const {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9);
  Eigen::Vector3d high = -low;
  for (const Solid& solid : solids) {
    Eigen::Vector3d half = Eigen::Vector3d::Zero();
    switch (solid.kind) {
      case Solid::Kind::kBox:
        half = solid.size_m / 2;
        break;
      case Solid::Kind::kSphere:
        half.setConstant(solid.size_m[0]);
        break;
      case Solid::Kind::kCylinder:
        half = {solid.size_m[0], solid.size_m[0], solid.size_m[1] / 2};
        break;
    }
    low = low.cwiseMin(solid.p_BodySolid_m - half);
    high = high.cwiseMax(solid.p_BodySolid_m + half);
  }
  return high - low;
}

Polygon Body::outline(const EyeView& eye, const Eigen::Vector3d& p_RootBody_m, double yaw_rad) const {
  return outline(eye, p_RootBody_m, Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix());
}

Polygon Body::outline(const EyeView& eye, const Eigen::Vector3d& p_RootBody_m,
                      const Eigen::Matrix3d& R_RootBody) const {
  const Eigen::Isometry3d X_CameraRoot = eye.X_RootCamera.inverse();
  std::vector<Eigen::Vector2d> points;
  const auto add = [&](const Eigen::Vector3d& p) { return add_projected(eye, X_CameraRoot, p, points); };
  for (const Solid& solid : solids) {
    const Eigen::Vector3d centre = p_RootBody_m + R_RootBody * solid.p_BodySolid_m;
    switch (solid.kind) {
      case Solid::Kind::kBox:
        for (int corner = 0; corner < 8; ++corner) {
          const Eigen::Vector3d sign((corner & 1) != 0 ? 0.5 : -0.5, (corner & 2) != 0 ? 0.5 : -0.5,
                                     (corner & 4) != 0 ? 0.5 : -0.5);
          if (!add(centre + R_RootBody * solid.size_m.cwiseProduct(sign))) return {};
        }
        break;
      case Solid::Kind::kSphere: {
        // the circle where lines of sight touch the sphere: a little nearer and smaller than the great circle
        const Eigen::Vector3d towards_eye = eye.X_RootCamera.translation() - centre;
        const double distance = towards_eye.norm();
        const double radius = solid.size_m[0];
        if (distance <= radius) return {};
        const Eigen::Vector3d n = towards_eye / distance;
        const Eigen::Vector3d u = n.unitOrthogonal();
        const double ratio = radius / distance;
        if (!circle(centre + n * radius * ratio, u, n.cross(u), radius * std::sqrt(1 - ratio * ratio), add))
          return {};
        break;
      }
      case Solid::Kind::kCylinder:
        for (const double end : {-0.5, 0.5}) {
          if (!circle(centre + end * solid.size_m[1] * R_RootBody.col(2), R_RootBody.col(0),
                      R_RootBody.col(1), solid.size_m[0], add)) {
            return {};
          }
        }
        break;
    }
  }
  return intersection(convex_hull(std::move(points)),
                      image_rectangle(eye.camera.width_px, eye.camera.height_px));
}

}  // namespace nido::vision
