#pragma once

#include <Eigen/Geometry>

#include "nido/interfaces/result.h"

namespace nido::sim {

// An ideal pinhole camera. A point (x, y, z) in the camera frame, in metres, is seen at
//     u = fx_px * x / z + cx_px,   v = fy_px * y / z + cy_px
// in continuous image coordinates: u = 0 is the left edge of the image and u = width its right edge, v = 0
// the top edge, so that the centre of the pixel in column i, row j lies at (i + 0.5, j + 0.5). Libraries that
// put pixel centres at whole numbers (OpenCV) have to add 0.5 to their coordinates, or to use cx - 0.5 and cy
// - 0.5.
struct Camera {
  // optical frame: z forward, x to the right in the image, y down
  Eigen::Isometry3d X_WorldCamera = Eigen::Isometry3d::Identity();
  int width = 320;   // pixels
  int height = 240;  // pixels
  double fx_px = 257.34;
  double fy_px = 257.34;
  double cx_px = 160.0;
  double cy_px = 120.0;
  double near_m = 0.04;  // nearer things are not drawn
  double far_m = 20.0;   // farther things are not drawn

  // Refuses sizes outside 1..4096, focal lengths that are not positive, planes out of order, and values that
  // are not finite, naming the value.
  Status check() const;
};

// A camera at `eye_World_m` that looks at `target_World_m` with the world's z up in the image, with square
// pixels and the given vertical field of view. Eye and target must not be above one another.
Camera lookAt(const Eigen::Vector3d& eye_World_m, const Eigen::Vector3d& target_World_m, int width,
              int height, double vertical_fov_rad);

}  // namespace nido::sim
