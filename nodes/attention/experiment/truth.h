#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "nido/kinematics/camera_geometry.h"
#include "scenes.h"

namespace nido::attention {

// The pixels (255) at whose centres a camera sees the first of these things, and not one of the others before
// it: row after row, camera.width_px * camera.height_px.
std::vector<std::uint8_t> silhouette(const PinholeCamera& camera, const Eigen::Isometry3d& X_RootCamera,
                                     const std::vector<Placed>& placed);

// Overlap of two masks of one size: pixels on in both over pixels on in any; 0 when both are empty.
double intersection_over_union(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b);

}  // namespace nido::attention
