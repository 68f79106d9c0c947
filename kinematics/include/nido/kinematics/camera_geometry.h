#pragma once

#include <Eigen/Geometry>
#include <optional>

namespace nido {

// A camera without distortion. Camera frame: origin in the pinhole, z forward, x right and y down in the
// image. Image coordinates are continuous: u = 0 is the image's left edge, and the centre of the pixel in
// column i, row j lies at (i + 0.5, j + 0.5), as in CameraInfo. Plain value, thread-compatible.
struct PinholeCamera {
  double fx_px = 257.34;
  double fy_px = 257.34;
  double cx_px = 160;
  double cy_px = 120;
  int width_px = 320;
  int height_px = 240;

  // Where a point appears; nothing if it is not in front of the camera. May lie outside the image.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_Camera_m) const;
  // Unit vector towards what is seen at a pixel.
  [[nodiscard]] Eigen::Vector3d ray_Camera(const Eigen::Vector2d& px) const;
  // Inside the image by at least `margin_px`.
  [[nodiscard]] bool contains(const Eigen::Vector2d& px, double margin_px = 0) const;
};

// A half line.
struct Ray {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // unit vector
};
// The ray of a pixel in the frame that X_FrameCamera leads to.
[[nodiscard]] Ray ray_of_pixel(const PinholeCamera& camera, const Eigen::Isometry3d& X_FrameCamera,
                               const Eigen::Vector2d& px);

// Where two rays meet.
struct Triangulation {
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();  // middle of the shortest segment between the rays
  double gap_m = 0;                               // length of that segment: how badly they miss each other
  double distance_left_m = 0;                     // along the first and the second ray
  double distance_right_m = 0;
};
// Nothing if the rays are parallel or meet behind an origin.
[[nodiscard]] std::optional<Triangulation> triangulate(const Ray& left, const Ray& right);

// Where a ray meets the plane with the given normal through a point; nothing if parallel or behind the
// origin.
[[nodiscard]] std::optional<Eigen::Vector3d> meet_plane(const Ray& ray, const Eigen::Vector3d& p_Plane_m,
                                                        const Eigen::Vector3d& normal);

}  // namespace nido
