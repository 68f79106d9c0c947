#pragma once

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "nido/kinematics/robot_model.h"
#include "nido/simulator/simulation.h"

namespace nido::sim {

// One shape of config/robots/grasp_postures.yaml.
struct GraspPosture {
  Eigen::Matrix3d R_RootPalm = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_PalmObject_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d approach_m = Eigen::Vector3d::Zero();
  std::array<double, 9> preshape_rad{};  // joints 7 to 15 of the arm
  std::array<double, 9> close_rad{};
  double close_speed_rad_s = 1.5;
  double close_time_s = 1.3;
};
std::map<std::string, GraspPosture> read_postures(const std::string& path);

// Torso (yaw, pitch) and right arm that bring the palm somewhere: damped least squares from several starts.
class ArmReach {
 public:
  explicit ArmReach(const RobotModel& model);
  // Remaining distance (m plus 0.1 per rad) of the best try; `axes_rad` starts and ends it.
  double solve(Eigen::VectorXd& axes_rad, const Eigen::Isometry3d& X_RootPalm, int iterations) const;
  double search(Eigen::VectorXd& axes_rad, const Eigen::Isometry3d& X_RootPalm) const;
  [[nodiscard]] const RobotModel& model() const { return model_; }
  [[nodiscard]] int first_arm_axis() const { return arm_; }
  [[nodiscard]] int first_torso_axis() const { return torso_; }

 private:
  const RobotModel& model_;
  int palm_ = 0;
  int arm_ = 0;
  int torso_ = 0;
  std::vector<int> axes_;
};

struct GraspTrial {
  std::string object;                                      // name in the world
  Eigen::Vector3d error_Root_m = Eigen::Vector3d::Zero();  // how wrong the object's place is believed to be
  std::string basket;                                      // carried there and let go; empty: only lifted
  double hold_s = 3;                                       // after lifting
};
struct GraspResult {
  std::string trouble;  // why it was not tried
  HoldQuery hold;       // at the end of the hold
  double lifted_m = 0;
  double slip_m = 0;  // of the object in the palm during the hold
  bool in_basket = false;
};
// Moves the arm by inverse kinematics from true positions: tries the body, not the robot's senses.
GraspResult try_grasp(Simulation& simulation, const ArmReach& reach, const GraspPosture& posture,
                      const GraspTrial& trial);

}  // namespace nido::sim
