#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nido/kinematics/robot_model.h"

namespace nido {

// The hinges between the root and one link, where each is moved by one axis: arms and legs, not eyes and
// fingers. Some of the axes may move, the others are given. Immutable, so thread-safe.
class SerialChain {
 public:
  // `axes`: names, from the root outwards or in any order; their order is that of all joint vectors here.
  // kNotFound for names that the model lacks; kInvalidArgument when one does not lie between root and tip or
  // shares its hinge.
  static Result<SerialChain> create(const RobotModel& model, const std::string& tip_link,
                                    const std::vector<std::string>& axes);

  [[nodiscard]] Eigen::Index size() const { return lower_rad_.size(); }
  [[nodiscard]] const Eigen::VectorXd& lower_rad() const { return lower_rad_; }
  [[nodiscard]] const Eigen::VectorXd& upper_rad() const { return upper_rad_; }
  [[nodiscard]] const Eigen::VectorXd& velocity_rad_s() const { return velocity_rad_s_; }

  [[nodiscard]] Eigen::Isometry3d X_RootTip(const Eigen::VectorXd& q_rad) const;
  // And the velocity of the tip's origin (rows 0-2, m/rad) and its turn rate (3-5, rad/rad) by joint, in the
  // root frame. `jacobian` is (6, size()) already.
  Eigen::Isometry3d X_RootTip(const Eigen::VectorXd& q_rad,
                              Eigen::Matrix<double, 6, Eigen::Dynamic>& jacobian) const;
  // The frame behind the joint that is the n-th from the root: in it the next joint turns about z. Behind the
  // last one the tip's.
  [[nodiscard]] Eigen::Isometry3d X_RootLink(const Eigen::VectorXd& q_rad,
                                             Eigen::Index joint_from_root) const;
  // The same joints with another tip, fixed to this one's.
  [[nodiscard]] SerialChain with_tip(const Eigen::Isometry3d& X_TipNew) const;

 private:
  struct Step {
    Eigen::Isometry3d X_ParentJoint = Eigen::Isometry3d::Identity();
    Eigen::Index joint = -1;
  };
  std::vector<Step> steps_;  // from the root outwards
  Eigen::Isometry3d X_LastTip_ = Eigen::Isometry3d::Identity();
  Eigen::VectorXd lower_rad_;
  Eigen::VectorXd upper_rad_;
  Eigen::VectorXd velocity_rad_s_;
};

// Where the tip of a chain shall be.
struct ChainGoal {
  Eigen::Isometry3d X_RootTip = Eigen::Isometry3d::Identity();
  bool with_orientation = true;  // false: the position alone
};

struct ChainOptions {
  // A joint that may not move: its position is that of the start. (size()) or empty: all may.
  std::vector<bool> locked{};
  // Limits that are narrower than the joints' own; empty: these.
  std::optional<Eigen::VectorXd> lower_rad{};
  std::optional<Eigen::VectorXd> upper_rad{};
  // Posture that is kept near as far as the goal leaves freedom; empty: the start.
  std::optional<Eigen::VectorXd> rest_rad{};
  double rest_weight = 0.02;  // cost of one rad from rest, against 1 mm or 0.01 rad off the goal
  double margin_rad = 0.005;  // kept to the joint limits
  int iterations = 60;        // of one start
  int starts = 12;  // at most: the given posture, then postures drawn from the seed, until the goal is met
  std::uint64_t seed = 1;
  double position_enough_m = 0.0005;  // the goal is met
  double turn_enough_rad = 0.004;
};

struct ChainSolution {
  Eigen::VectorXd q_rad;
  double position_error_m = 0;
  double turn_error_rad = 0;  // 0 without orientation
  int starts = 1;             // that were tried
};

// Joints that bring the tip to a goal: damped least squares within the limits (Levenberg-Marquardt; a joint
// at a limit that is pushed outwards is left out of the step). Near a singularity the damping grows, so the
// posture stays finite and the error tells. Always gives the best posture found. Deterministic.
[[nodiscard]] ChainSolution solve_chain(const SerialChain& chain, const ChainGoal& goal,
                                        const Eigen::VectorXd& start_rad, const ChainOptions& options = {});

}  // namespace nido
