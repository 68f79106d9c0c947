#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/reach/arm_chain.h"
#include "nido/reach/inverse_kinematics.h"
#include "nido/reach/joint_path.h"
#include "nido/reach/posture_network.h"
#include "nido/reach/seen_hand.h"

namespace nido::reach {

// Something on the table, as vision reported it.
struct SeenObject {
  std::string name;
  Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();  // centre
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();    // along root x, y, z
};

// How to hold the palm to a kind of thing. "Object frame": at the object's centre, axes as the root frame
// turned about the vertical by the object's yaw and the chosen turn.
struct PalmPosture {
  Eigen::Isometry3d X_ObjectPalm = Eigen::Isometry3d::Identity();
  Eigen::Vector3d approach_Object = -Eigen::Vector3d::UnitZ();  // unit direction of the last straight way
  double standoff_m = 0.08;                                     // length of that way
  std::vector<double> turns_rad = {
      0.0};                // turns about the vertical that serve as well; the first is liked most
  double turn_cost = 2.0;  // per rad away from the first
  // The object looks the same after this turn, so its yaw counts modulo this; zero: the yaw does not count.
  double yaw_period_rad = 0.0;
  // Set: heights in X_ObjectPalm count from so far above the object's top, not from its centre.
  std::optional<double> above_top_m;
};

struct PlannerOptions {
  Joints home = Joints::Zero();                        // hand in view, out of the way of the table
  Joints speed_rad_s = Joints::Constant(0.9);          // limit of free motion
  Joints torso_and_arm_min = Joints::Constant(-10.0);  // narrower limits than the body's own, where wanted
  Joints torso_and_arm_max = Joints::Constant(10.0);
  Joints rest_weight = Joints::Constant(0.1);
  // The workplace: a block from the table's top down; nothing of the arm goes in. How high it is, is seen:
  // two or more things whose undersides are level stand on it.
  bool table_is_seen = true;
  Eigen::Vector3d table_min_Root_m = {-0.62, -0.36, -0.60};
  Eigen::Vector3d table_max_Root_m = {-0.20, 0.36, -0.0826};
  double clearance_m = 0.012;           // wanted between flesh and things on free ways
  double position_tolerance_m = 0.004;  // a posture farther off its goal counts as out of reach
  double turn_tolerance_rad = 0.07;
};

// A way to a thing: free to the stand-off, straight from there.
struct ApproachPlan {
  PalmGoal goal;
  PalmGoal standoff;
  Joints q_goal = Joints::Zero();
  Joints q_standoff = Joints::Zero();
  double turn_rad = 0.0;  // the one of PalmPosture::turns_rad that was taken
};

// Plans of the arm through its workspace: postures by learned model and inverse kinematics, ways around table
// and things. Deterministic. Thread-compatible.
class MotionPlanner {
 public:
  MotionPlanner(ArmChain chain, SeenHandModel seen_hand, std::optional<PostureNetwork> postures,
                PlannerOptions options);

  // What the eyes say now beyond the learned model: seen minus predicted, root frame. Goals are met under it.
  void set_visual_offset(const Eigen::Vector3d& offset_m) { visual_offset_m_ = offset_m; }
  void set_objects(std::vector<SeenObject> objects);

  [[nodiscard]] const ArmChain& chain() const { return chain_; }
  [[nodiscard]] const SeenHandModel& seen_hand() const { return seen_hand_; }
  [[nodiscard]] const std::optional<PostureNetwork>& postures() const { return postures_; }
  [[nodiscard]] const PlannerOptions& options() const { return options_; }
  [[nodiscard]] const std::vector<SeenObject>& objects() const { return objects_; }

  // Palm pose as the eyes would see it.
  [[nodiscard]] Eigen::Isometry3d X_RootPalmSeen(const Joints& q) const;

  // Posture for a goal from many starts; kFailed in words when out of reach.
  [[nodiscard]] Result<Joints> posture_for(const PalmGoal& goal, const Joints& now) const;
  // Goal, stand-off and postures for a thing, with the best of the posture's turns. kFailed names position
  // and distance.
  [[nodiscard]] Result<ApproachPlan> approach(const PalmPosture& posture, const SeenObject& object,
                                              double yaw_rad, const Joints& now) const;
  // Free way between two postures around table and things. kFailed when every way tried touches something.
  [[nodiscard]] Result<JointPath> free_way(const Joints& from, const Joints& to) const;
  // Straight line of the goal's tool point from where it is now, turning evenly; the last posture meets the
  // goal.
  [[nodiscard]] Result<JointPath> straight_way(const Joints& from, const PalmGoal& goal, double speed_m_s,
                                               double joint_speed_share = 0.5) const;

  // Least distance of the arm's flesh from table and things, m; negative inside.
  [[nodiscard]] double clearance_m(const Joints& q) const;

 private:
  [[nodiscard]] Eigen::Vector3d offset_m(const Joints& q) const;
  [[nodiscard]] SolverOptions solver_options(const Joints& rest, double rest_weight) const;
  [[nodiscard]] Joints rest_for(const PalmGoal& goal) const;
  [[nodiscard]] bool meets(const PalmSolution& solution) const;
  [[nodiscard]] double table_clearance_m(const Joints& q) const;
  [[nodiscard]] double way_clearance_m(const JointPath& path) const;

  ArmChain chain_;
  SeenHandModel seen_hand_;
  std::optional<PostureNetwork> postures_;
  PlannerOptions options_;
  std::vector<Joints> starts_;
  std::vector<SeenObject> objects_;
  Eigen::Vector3d visual_offset_m_ = Eigen::Vector3d::Zero();
};

}  // namespace nido::reach
