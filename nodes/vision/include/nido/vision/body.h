#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "nido/kinematics/camera_geometry.h"
#include "nido/vision/polygon.h"

namespace nido::vision {

// One eye at the moment of a picture.
struct EyeView {
  PinholeCamera camera;
  Eigen::Isometry3d X_RootCamera = Eigen::Isometry3d::Identity();
};

// A solid that a body is built from.
struct Solid {
  enum class Kind { kBox, kSphere, kCylinder };
  Kind kind = Kind::kBox;
  Eigen::Vector3d size_m =
      Eigen::Vector3d::Zero();  // box: edges; sphere: radius; cylinder: radius, length along z
  Eigen::Vector3d p_BodySolid_m = Eigen::Vector3d::Zero();
};

// What vision remembers of a thing's shape: solids around the body's centre, z up when it stands.
struct Body {
  std::vector<Solid> solids;
  double symmetry_rad = 0;  // a turn about z by this changes nothing; 0: round

  // Edges of the upright box around the body at yaw 0.
  [[nodiscard]] Eigen::Vector3d extents_m() const;
  // Convex outline of the body as an eye sees it, cut at the image's border; empty if it is not in view.
  [[nodiscard]] Polygon outline(const EyeView& eye, const Eigen::Vector3d& p_RootBody_m,
                                const Eigen::Matrix3d& R_RootBody) const;
  // The same of the upright body, turned about the root's z.
  [[nodiscard]] Polygon outline(const EyeView& eye, const Eigen::Vector3d& p_RootBody_m,
                                double yaw_rad) const;
};

}  // namespace nido::vision
