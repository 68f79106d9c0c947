#include "nido/simulator/render/camera.h"

#include <cmath>
#include <string>

namespace nido::sim {

Status Camera::check() const {
  const auto refuse = [](const std::string& what, double value, const std::string& expected) {
    return Error{ErrorCode::kInvalidArgument,
                 "camera: " + what + " is " + std::to_string(value) + ", expected " + expected};
  };
  constexpr int kMaxSize = 4096;
  if (width < 1 || width > kMaxSize) return refuse("width", width, "1 to 4096 pixels");
  if (height < 1 || height > kMaxSize) return refuse("height", height, "1 to 4096 pixels");
  if (!std::isfinite(fx_px) || fx_px <= 0) return refuse("fx", fx_px, "a positive number of pixels");
  if (!std::isfinite(fy_px) || fy_px <= 0) return refuse("fy", fy_px, "a positive number of pixels");
  if (!std::isfinite(cx_px)) return refuse("cx", cx_px, "a finite number of pixels");
  if (!std::isfinite(cy_px)) return refuse("cy", cy_px, "a finite number of pixels");
  if (!std::isfinite(near_m) || near_m <= 0) return refuse("near plane", near_m, "a positive distance");
  if (!std::isfinite(far_m) || far_m <= near_m)
    return refuse("far plane", far_m, "a distance beyond the near plane");
  if (!X_WorldCamera.matrix().allFinite()) {
    return Error{ErrorCode::kInvalidArgument, "camera: the pose has an element that is not finite"};
  }
  return {};
}

Camera lookAt(const Eigen::Vector3d& eye_World_m, const Eigen::Vector3d& target_World_m, int width,
              int height, double vertical_fov_rad) {
  Camera camera;
  const Eigen::Vector3d forward = (target_World_m - eye_World_m).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  camera.X_WorldCamera.linear().col(0) = right;
  camera.X_WorldCamera.linear().col(1) = forward.cross(right);
  camera.X_WorldCamera.linear().col(2) = forward;
  camera.X_WorldCamera.translation() = eye_World_m;
  camera.width = width;
  camera.height = height;
  camera.fy_px = 0.5 * height / std::tan(0.5 * vertical_fov_rad);
  camera.fx_px = camera.fy_px;
  camera.cx_px = 0.5 * width;
  camera.cy_px = 0.5 * height;
  return camera;
}

}  // namespace nido::sim
