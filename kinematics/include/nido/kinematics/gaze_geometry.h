#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "nido/interfaces/task_control.h"
#include "nido/kinematics/camera_geometry.h"

namespace nido {

// What the eyes of a robot see where, by what its gaze tells of itself. Root frame, m; eye 0 left, 1 right.

[[nodiscard]] PinholeCamera eye_camera(const GazeBody& body);
// The pixel at which an eye sees a point; nothing when it is behind the eye. May lie outside the picture.
[[nodiscard]] std::optional<Eigen::Vector2d> pixel_of(const GazeBody& body, const GazeState& state, int eye,
                                                      const Eigen::Vector3d& p_Root_m);
// The line of sight of a pixel.
[[nodiscard]] Ray sight_of(const GazeBody& body, const GazeState& state, int eye, const Eigen::Vector2d& px);
// Azimuth, elevation and vergence of a point, as in GazeState.
[[nodiscard]] Eigen::Vector3d angles_of(const GazeBody& body, const Eigen::Vector3d& p_Root_m);
// The point in a direction, as IGazeControl::look_by_angles has it. kFailed for one to the side or behind.
[[nodiscard]] Result<Eigen::Vector3d> p_at_angles(const GazeBody& body, const GazeState& state, bool relative,
                                                  const Eigen::Vector3d& angles_rad);
// From the middle between the eyes to a point on which they meet with this vergence; below 1 degree it is
// taken for 1 degree.
[[nodiscard]] double distance_of_vergence_m(const GazeBody& body, double vergence_rad);

}  // namespace nido
