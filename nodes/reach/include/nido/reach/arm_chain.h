#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/kinematics/robot_model.h"

namespace nido::reach {

// Joints that move a hand, in the order of the boards: torso yaw, roll, pitch, then the first seven
// of the arm.
inline constexpr int kTorsoJoints = 3;
inline constexpr int kArmJoints = 7;
inline constexpr int kJoints = kTorsoJoints + kArmJoints;
using Joints = Eigen::Matrix<double, kJoints, 1>;  // rad
using Jacobian = Eigen::Matrix<double, 6, kJoints>;

// What the body knows of its own geometry (proprioception): the chain from the waist to the palm, from the
// URDF. A value, thread-compatible.
class ArmChain {
 public:
  // side: "right" or "left". kNotFound or kInvalidArgument name the joint or link that the model lacks.
  static Result<ArmChain> from_model(const RobotModel& model, const std::string& side);

  [[nodiscard]] const Joints& min() const { return min_; }
  [[nodiscard]] const Joints& max() const { return max_; }
  // What comes out of the palm, along z of the palm frame: 1 for the right hand, -1 for the left one.
  [[nodiscard]] double palm_z() const { return palm_z_; }
  [[nodiscard]] Joints clamped(const Joints& q) const { return q.cwiseMax(min_).cwiseMin(max_); }

  // Palm frame in the root frame: x towards the fingers, y away from the thumb, z out of the palm of the
  // right hand and out of the back of the left one.
  [[nodiscard]] Eigen::Isometry3d X_RootPalm(const Joints& q) const;
  // Palm frame, and velocity of its origin (rows 0-2) and turn rate (3-5) by joint speeds, in the root frame.
  [[nodiscard]] Eigen::Isometry3d X_RootPalm(const Joints& q, Jacobian& jacobian) const;

  // Points of the limb with the radius of the flesh around them, in the root frame, to keep clear of things.
  struct BodyPoint {
    Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();
    double radius_m = 0.0;
    bool of_hand = false;
  };
  [[nodiscard]] std::vector<BodyPoint> body_points(const Joints& q) const;

 private:
  struct Link {
    Eigen::Isometry3d X_ParentJoint = Eigen::Isometry3d::Identity();
    int joint = 0;  // index into Joints; its axis is z of the joint's frame
  };
  std::array<Link, kJoints> links_;  // from the waist outwards
  Eigen::Isometry3d X_LastPalm_ = Eigen::Isometry3d::Identity();
  double palm_z_ = 1.0;
  Joints min_ = Joints::Zero();
  Joints max_ = Joints::Zero();
};

}  // namespace nido::reach
