#pragma once

#include <Eigen/Core>
#include <optional>

#include "nido/attention/plane_sweep.h"

namespace nido::attention {

// What lies behind and beneath the fixated surface, as far as it is flat: a plane in space is a plane of
// inverse depth over the picture. plane number = at_x * x + at_y * y + offset, in pixels of a sweep's roi.
struct Background {
  double at_x = 0;
  double at_y = 0;
  double offset = 0;
  [[nodiscard]] double plane(double x, double y) const { return at_x * x + at_y * y + offset; }
};

// Number of the plane that a pixel is sure to lie on, or NaN: the best one must beat all those that are not
// beside it by `margin` grey levels. 32F, the roi's size.
cv::Mat sure_planes(const PlaneSweep& planes, double margin);

// The flat background that most of the sure pixels outside the segment lie on; nothing when they do not
// agree. `outside`: 8U, the roi's size. What lies at the surface's own distance or before it is no
// background: the surface's middle is at `surface_px` (of the roi) and on plane `surface_plane`.
// Deterministic.
std::optional<Background> find_background(const cv::Mat& sure, const cv::Mat& outside,
                                          const Eigen::Vector2d& surface_px, double surface_plane);

}  // namespace nido::attention
