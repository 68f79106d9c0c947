#pragma once

#include <array>
#include <optional>

#include "nido/vision/body.h"

namespace nido::vision {

// Both eyes at the moment of a pair of pictures: left, right.
using EyePair = std::array<EyeView, 2>;
// What was seen of one thing: its convex outline in the left and the right picture.
using OutlinePair = std::array<Polygon, 2>;

// Where a body stands so that its outlines match what was seen.
struct Fit {
  Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();  // the body's centre
  double yaw_rad = 0;
  double overlap = 0;  // mean over both eyes of intersection over union, 0..1
  // Rotation from the body's frame to that of an upright body of this yaw; none unless a leaning body
  // explains the outlines clearly better.
  Eigen::Matrix3d tilt = Eigen::Matrix3d::Identity();
  [[nodiscard]] Eigen::Matrix3d R_RootBody() const {
    return Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix() * tilt;
  }
};

// The point whose images lie nearest to two image points; nothing if the lines of sight miss each other by
// more than `max_gap_m` or meet behind the eyes.
[[nodiscard]] std::optional<Eigen::Vector3d> meet(const EyePair& eyes, const Eigen::Vector2d& left_px,
                                                  const Eigen::Vector2d& right_px, double max_gap_m);

// Fits a body to outlines: moves it until the outlines' centres agree, and turns it to the best overlap.
// `start` gives the pose to begin with; `search_yaw`: try all yaws, else only near the start. Leaning poses
// are tried when no upright one explains what is seen. Nothing if the body cannot be seen where the outlines
// are.
[[nodiscard]] std::optional<Fit> fit_body(const Body& body, const EyePair& eyes, const OutlinePair& seen,
                                          const Fit& start, bool search_yaw);

// Overlap of the body's outlines at a pose with what was seen.
[[nodiscard]] double pose_overlap(const Body& body, const EyePair& eyes, const OutlinePair& seen,
                                  const Fit& pose);

}  // namespace nido::vision
