#include "nido/reach/arm_chain.h"

#include <algorithm>

namespace nido::reach {
namespace {

std::array<std::string, kJoints> joint_names(const std::string& prefix) {
  return {"torso_yaw",
          "torso_roll",
          "torso_pitch",
          prefix + "shoulder_pitch",
          prefix + "shoulder_roll",
          prefix + "shoulder_yaw",
          prefix + "elbow",
          prefix + "wrist_prosup",
          prefix + "wrist_pitch",
          prefix + "wrist_yaw"};
}

}  // namespace

Result<ArmChain> ArmChain::from_model(const RobotModel& model, const std::string& side) {
  auto hand = model.hand(side);
  if (!hand) return hand.error();
  const std::array<std::string, kJoints> names = joint_names(side.substr(0, 1) + "_");
  ArmChain chain;
  chain.palm_z_ = side == "left" ? -1.0 : 1.0;
  Eigen::Isometry3d X_JointBelow = Eigen::Isometry3d::Identity();  // of what was passed, in the frame now at
  std::size_t next = kJoints;
  for (int link = hand->frame; link >= 0; link = model.links()[static_cast<std::size_t>(link)].parent) {
    const BodyLink& body = model.links()[static_cast<std::size_t>(link)];
    if (body.hinge < 0) {
      X_JointBelow = body.X_ParentChild0 * X_JointBelow;
      continue;
    }
    const Hinge& hinge = model.hinges()[static_cast<std::size_t>(body.hinge)];
    const auto index = std::find(names.begin(), names.end(), hinge.name) - names.begin();
    if (index == kJoints || next == 0) {
      return Error{ErrorCode::kInvalidArgument, "robot model: joint '" + hinge.name + "' between waist and " +
                                                    side + " hand is none of the torso's and arm's ten"};
    }
    // what hangs below becomes the offset of the next joint, or of the palm, in this joint's frame
    (next == kJoints ? chain.X_LastPalm_ : chain.links_[next].X_ParentJoint) = X_JointBelow;
    chain.links_[--next].joint = static_cast<int>(index);
    chain.min_(index) = hinge.lower_rad;
    chain.max_(index) = hinge.upper_rad;
    X_JointBelow = body.X_ParentChild0;
  }
  if (next != 0) {
    return Error{ErrorCode::kInvalidArgument, "robot model: " + std::to_string(kJoints - next) +
                                                  " joints between waist and " + side +
                                                  " hand, expected the torso's 3 and the arm's 7"};
  }
  chain.links_[0].X_ParentJoint = X_JointBelow;
  return chain;
}

Eigen::Isometry3d ArmChain::X_RootPalm(const Joints& q) const {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  for (const Link& link : links_)
    X = X * link.X_ParentJoint * Eigen::AngleAxisd(q(link.joint), Eigen::Vector3d::UnitZ());
  return X * X_LastPalm_;
}

Eigen::Isometry3d ArmChain::X_RootPalm(const Joints& q, Jacobian& jacobian) const {
  std::array<Eigen::Isometry3d, kJoints> frames;
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < links_.size(); ++i) {
    X = X * links_[i].X_ParentJoint * Eigen::AngleAxisd(q(links_[i].joint), Eigen::Vector3d::UnitZ());
    frames[i] = X;
  }
  X = X * X_LastPalm_;
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Eigen::Vector3d axis = frames[i].linear().col(2);
    jacobian.col(links_[i].joint).head<3>() = axis.cross(X.translation() - frames[i].translation());
    jacobian.col(links_[i].joint).tail<3>() = axis;
  }
  return X;
}

std::vector<ArmChain::BodyPoint> ArmChain::body_points(const Joints& q) const {
  std::vector<BodyPoint> points;
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  Eigen::Vector3d elbow = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < links_.size(); ++i) {
    X = X * links_[i].X_ParentJoint * Eigen::AngleAxisd(q(links_[i].joint), Eigen::Vector3d::UnitZ());
    if (i == 6) elbow = X.translation();  // torso 3, shoulder 3, elbow
    if (i == 8) {                         // the wrist's axes meet here
      const Eigen::Vector3d wrist = X.translation();
      for (const double share : {0.0, 0.33, 0.66})
        points.push_back({elbow + share * (wrist - elbow), 0.03, false});
      points.push_back({wrist, 0.03, false});
    }
  }
  X = X * X_LastPalm_;
  X.linear().col(2) *= palm_z_;  // the left hand is the mirror image of the right one
  // palm; fingers and thumb as they are when they are open or made ready to grasp
  for (const Eigen::Vector3d& p_Palm_m :
       {Eigen::Vector3d(-0.03, 0.0, -0.015), Eigen::Vector3d(0.0, -0.03, -0.01),
        Eigen::Vector3d(0.0, 0.03, -0.01), Eigen::Vector3d(-0.022, -0.02, 0.02),
        Eigen::Vector3d(-0.018, -0.03, 0.043)}) {
    points.push_back({X * p_Palm_m, 0.012, true});
  }
  for (const Eigen::Vector3d& p_Palm_m :
       {Eigen::Vector3d(-0.008, -0.051, 0.073), Eigen::Vector3d(-0.016, -0.013, 0.084),
        Eigen::Vector3d(0.015, -0.068, 0.045), Eigen::Vector3d(0.04, -0.034, 0.0),
        Eigen::Vector3d(0.04, 0.03, 0.0), Eigen::Vector3d(0.072, -0.045, 0.024),
        Eigen::Vector3d(0.05, -0.04, 0.042), Eigen::Vector3d(0.062, -0.008, 0.042),
        Eigen::Vector3d(0.085, -0.008, 0.02), Eigen::Vector3d(0.078, 0.02, 0.006),
        Eigen::Vector3d(0.068, 0.046, 0.0)}) {
    points.push_back({X * p_Palm_m, 0.008, true});
  }
  return points;
}

}  // namespace nido::reach
