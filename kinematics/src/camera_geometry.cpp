#include "nido/kinematics/camera_geometry.h"

#include <cmath>

namespace nido {

std::optional<Eigen::Vector2d> PinholeCamera::project(const Eigen::Vector3d& p_Camera_m) const {
  if (!(p_Camera_m.z() > 1e-9)) return std::nullopt;
  return Eigen::Vector2d(fx_px * p_Camera_m.x() / p_Camera_m.z() + cx_px,
                         fy_px * p_Camera_m.y() / p_Camera_m.z() + cy_px);
}

Eigen::Vector3d PinholeCamera::ray_Camera(const Eigen::Vector2d& px) const {
  return Eigen::Vector3d((px.x() - cx_px) / fx_px, (px.y() - cy_px) / fy_px, 1.0).normalized();
}

bool PinholeCamera::contains(const Eigen::Vector2d& px, double margin_px) const {
  return px.x() >= margin_px && px.y() >= margin_px && px.x() <= width_px - margin_px &&
         px.y() <= height_px - margin_px;
}

Ray ray_of_pixel(const PinholeCamera& camera, const Eigen::Isometry3d& X_FrameCamera,
                 const Eigen::Vector2d& px) {
  return {X_FrameCamera.translation(), X_FrameCamera.linear() * camera.ray_Camera(px)};
}

std::optional<Triangulation> triangulate(const Ray& left, const Ray& right) {
  const Eigen::Vector3d w = left.origin_m - right.origin_m;
  const double b = left.direction.dot(right.direction);
  const double denominator = 1.0 - b * b;
  if (denominator < 1e-10) return std::nullopt;
  const double d = left.direction.dot(w);
  const double e = right.direction.dot(w);
  Triangulation result;
  result.distance_left_m = (b * e - d) / denominator;
  result.distance_right_m = (e - b * d) / denominator;
  if (result.distance_left_m <= 0 || result.distance_right_m <= 0) return std::nullopt;
  const Eigen::Vector3d p_Left = left.origin_m + result.distance_left_m * left.direction;
  const Eigen::Vector3d p_Right = right.origin_m + result.distance_right_m * right.direction;
  result.p_m = 0.5 * (p_Left + p_Right);
  result.gap_m = (p_Left - p_Right).norm();
  return result;
}

std::optional<Eigen::Vector3d> meet_plane(const Ray& ray, const Eigen::Vector3d& p_Plane_m,
                                          const Eigen::Vector3d& normal) {
  const double slope = ray.direction.dot(normal);
  if (std::abs(slope) < 1e-12) return std::nullopt;
  const double distance = (p_Plane_m - ray.origin_m).dot(normal) / slope;
  if (distance <= 0) return std::nullopt;
  return ray.origin_m + distance * ray.direction;
}

}  // namespace nido
