#pragma once

#include <ode/ode.h>

#include <Eigen/Geometry>
#include <string_view>
#include <vector>

#include "robot_description.h"
#include "robot_tree.h"

namespace nido::sim {

// The robot: its motion is the tree's, and every link has an ODE body that follows it and carries what can
// touch. Links carry no gravity: a servo that compensates gravity perfectly cancels it in every hinge, so it
// is put back only into the hinges whose drive does not compensate it (gravity_torques()). That is the same
// motion.
class RobotBody {
 public:
  RobotBody(dWorldID world, RobotDescription description);
  ~RobotBody();
  RobotBody(const RobotBody&) = delete;
  RobotBody& operator=(const RobotBody&) = delete;

  [[nodiscard]] const RobotDescription& description() const { return description_; }
  [[nodiscard]] std::size_t link_count() const { return description_.links.size(); }
  [[nodiscard]] RobotTree& tree() { return tree_; }
  [[nodiscard]] const RobotTree& tree() const { return tree_; }

  // One for each link but 0 (index 0: nullptr). Enabled: its limb moves.
  [[nodiscard]] const std::vector<dBodyID>& bodies() const { return bodies_; }

  [[nodiscard]] double angle_rad(std::size_t link) const { return tree_.angle_rad(link); }
  [[nodiscard]] double velocity_rad_s(std::size_t link) const { return tree_.speed_rad_s(link); }
  [[nodiscard]] Eigen::Isometry3d X_WorldLink(std::size_t link) const;

  // Moves all links to the angles (by link; 0 unused) at once, at rest. A free base stays where it is.
  void place(const std::vector<double>& angle_rad);
  // The base is free: nothing but what it touches holds it.
  [[nodiscard]] bool is_free() const { return description_.links.size() > 1 && floats(1); }
  // A free base back to where it begins, upright, at rest; a fixed one is always there.
  void put_base_back();
  // How far above (below zero: under) the world's origin the root of a free base begins.
  void set_base_height(double z_World_m) { base_height_m_ = z_World_m; }
  // The link is one of the base's degrees of freedom, which no motor moves.
  [[nodiscard]] bool floats(std::size_t link) const {
    return description_.links[link].freedom != Freedom::kHinge;
  }
  // Torque that gravity exerts about each hinge (by link), and what it does to a free base.
  void gravity_torques(std::vector<double>& torque_Nm) const;

  // A limb on the root whose first link is awake is awake as a whole; else it stands still and costs nothing.
  void wake(std::size_t link) { dBodyEnable(bodies_[link]); }
  void rest(std::size_t limb);
  [[nodiscard]] bool awake(std::size_t limb) const;
  // Tells the bodies of a limb where its links are now.
  void show(std::size_t limb);

  struct State {
    RobotTree::State tree;
    std::vector<bool> awake;  // by link
  };
  [[nodiscard]] State save() const;
  void restore(const State& state);

  // Pose of a URDF frame; link index and fixed offset.
  struct Frame {
    int link = -1;
    Eigen::Isometry3d X_LinkFrame = Eigen::Isometry3d::Identity();
  };
  [[nodiscard]] Frame find_frame(std::string_view name) const;

 private:
  RobotDescription description_;
  RobotTree tree_;
  std::vector<dBodyID> bodies_;
  double base_height_m_ = 0;
};

}  // namespace nido::sim
