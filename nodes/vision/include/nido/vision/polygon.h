#pragma once

#include <Eigen/Core>
#include <vector>

namespace nido::vision {

// Corners of a convex polygon in image coordinates (px), counter-clockwise in a frame with y up; empty or
// degenerate polygons have fewer than three.
using Polygon = std::vector<Eigen::Vector2d>;

// The smallest convex polygon around points.
[[nodiscard]] Polygon convex_hull(std::vector<Eigen::Vector2d> points);
// px^2; 0 for degenerate ones.
[[nodiscard]] double area(const Polygon& polygon);
// Centre of the area; the mean of the corners of degenerate ones. Not for empty ones.
[[nodiscard]] Eigen::Vector2d centroid(const Polygon& polygon);
[[nodiscard]] Polygon intersection(const Polygon& a, const Polygon& b);
// Area of the intersection over that of the union, 0..1.
[[nodiscard]] double overlap(const Polygon& a, const Polygon& b);
// The polygon with every corner moved away from the centroid by `px`.
[[nodiscard]] Polygon grown(const Polygon& polygon, double px);
[[nodiscard]] Polygon image_rectangle(int width_px, int height_px);
[[nodiscard]] bool contains(const Polygon& polygon, const Eigen::Vector2d& point);

}  // namespace nido::vision
