#pragma once

#include <ode/ode.h>

#include <Eigen/Geometry>
#include <string_view>
#include <vector>

#include "robot_description.h"

namespace nido::sim {

// The robot as ODE bodies and hinges. Bodies carry no gravity: a servo that compensates gravity perfectly
// cancels it in every hinge, so it is put back only into the hinges whose drive does not compensate it
// (gravity_torques()). That is the same motion, but the solver need not carry the arm's weight through its
// chain of hinges in every step.
class RobotBody {
 public:
  RobotBody(dWorldID world, RobotDescription description);
  ~RobotBody();
  RobotBody(const RobotBody&) = delete;
  RobotBody& operator=(const RobotBody&) = delete;

  [[nodiscard]] const RobotDescription& description() const { return description_; }
  [[nodiscard]] std::size_t link_count() const { return description_.links.size(); }

  // One for each link but 0 (index 0: nullptr).
  [[nodiscard]] const std::vector<dBodyID>& bodies() const { return bodies_; }
  [[nodiscard]] const std::vector<dJointID>& hinges() const { return hinges_; }
  // Feedback of every hinge, written by the solver.
  [[nodiscard]] const std::vector<dJointFeedback>& feedback() const { return feedback_; }

  [[nodiscard]] double angle_rad(std::size_t link) const { return dJointGetHingeAngle(hinges_[link]); }
  [[nodiscard]] double velocity_rad_s(std::size_t link) const {
    return dJointGetHingeAngleRate(hinges_[link]);
  }
  [[nodiscard]] Eigen::Isometry3d X_WorldLink(std::size_t link) const;

  // Moves all links to the angles (by link; 0 unused) at once, at rest.
  void place(const std::vector<double>& angle_rad);
  // Torque that gravity exerts about each hinge (by link).
  void gravity_torques(std::vector<double>& torque_Nm) const;
  // Torque about the hinge that the solver applied in the last step: motor and end stop.
  [[nodiscard]] double constraint_torque_Nm(std::size_t link) const;

  // Pose of a URDF frame; link index and fixed offset.
  struct Frame {
    int link = -1;
    Eigen::Isometry3d X_LinkFrame = Eigen::Isometry3d::Identity();
  };
  [[nodiscard]] Frame find_frame(std::string_view name) const;

 private:
  RobotDescription description_;
  std::vector<dBodyID> bodies_;
  std::vector<dJointID> hinges_;
  std::vector<dJointFeedback> feedback_;
};

}  // namespace nido::sim
