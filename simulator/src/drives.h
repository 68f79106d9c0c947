#pragma once

#include <span>
#include <vector>

#include "control_block.h"
#include "nido/interfaces/result.h"
#include "nido/simulator/faults.h"
#include "nido/simulator/joints.h"
#include "robot_body.h"
#include "trajectory.h"

namespace nido::sim {

// One joint as clients see it, while it runs.
struct AxisState {
  JointState measured;
  double reference_rad = 0;  // where the servo wants it now
  double reference_velocity_rad_s = 0;
  double previous_reference_rad = 0;  // at the beginning of this control period
  JointFault fault = JointFault::kNone;
  double held_rad = 0;    // where it stands when stuck
  bool at_limit = false;  // a mode without servo pushed it out of its range: the servo keeps it at the limit
  Trajectory trajectory;
};

// All joints of the robot: modes, trajectories, coupling of joints to hinges, servos, limits.
class Drives {
 public:
  // Fails when the block names a hinge that the robot lacks, or the robot has a hinge that no joint moves.
  static Result<Drives> create(const RobotBody& robot, const ControlBlock& block);

  [[nodiscard]] const std::vector<PartInfo>& parts() const { return parts_; }
  [[nodiscard]] std::span<const JointState> joints(int part) const {
    return measured_[static_cast<std::size_t>(part)];
  }

  Status command(int part, JointMode mode, std::span<const int> joints, std::span<const double> values);
  Status set_reference_speed(int part, int joint, double speed_rad_s);
  Status set_servo_gain(int part, int joint, double gain_1_s);
  Status stop(int part, int joint);
  // Until the next reset. Part and joint exist. Of joints that share hinges only this one is faulty.
  void set_fault(int part, int joint, JointFault fault);
  [[nodiscard]] JointFault fault(int part, int joint) const { return axes_[axis_index(part, joint)].fault; }
  Status place(int part, std::span<const double> position_rad, RobotBody& robot);
  // Other angles for home; refused beyond the limits.
  Status set_home(int part, std::span<const double> position_rad);
  // All joints home and at rest.
  void go_home(RobotBody& robot);

  // Once a control period, before its physics steps.
  void begin_period(double period_s, const RobotBody& robot);
  // Before every physics step; `fraction`: how much of the control period will have passed after it, 0..1.
  void drive(double fraction, RobotBody& robot);
  // After every physics step.
  void accumulate(const RobotBody& robot);
  // After the last physics step of a period.
  void measure(const RobotBody& robot);

  // True when the hinge's servo has nothing to do: no reference moves and the hinge stands where it should.
  [[nodiscard]] bool still(std::size_t link, const RobotBody& robot) const;

  [[nodiscard]] const std::vector<AxisState>& axes() const { return axes_; }

  // Everything that changes, to save and restore.
  struct State {
    std::vector<AxisState> axes;
    std::vector<double> applied_torque_Nm;
  };
  [[nodiscard]] State save() const { return {axes_, hinge_torque_Nm_}; }
  void restore(const State& state);

 private:
  struct Share {
    std::size_t link;
    double multiplier;
    double offset_rad;
  };
  struct Axis {
    int part = 0;
    JointInfo info;
    double home_rad = 0;
    double gain_1_s = 0;  // of its servo after a reset
    std::vector<Share> shares;
  };
  // What a hinge's servo may do; offset is the sum over its joints.
  struct Hinge {
    std::vector<std::pair<std::size_t, double>> axes;  // axis, multiplier
    double offset_rad = 0;
    double gain_1_s = 0;
    double max_velocity_rad_s = 0;
    double top_speed_rad_s = 0;  // when all its joints move at their limit of speed
    double max_torque_Nm = 0;
  };

  [[nodiscard]] std::size_t axis_index(int part, int joint) const {
    return first_axis_[static_cast<std::size_t>(part)] + static_cast<std::size_t>(joint);
  }
  [[nodiscard]] std::vector<double> hinge_angles(const std::vector<double>& axis_rad) const;
  void advance_reference(std::size_t axis, double period_s);
  void watch_limits(const RobotBody& robot);
  // Position and velocity of a joint, read off its hinges as they are now.
  [[nodiscard]] std::pair<double, double> motion_of(std::size_t axis, const RobotBody& robot) const;
  // Some of the joints that share the hinge are faulty.
  [[nodiscard]] bool shares_a_fault(const Hinge& hinge) const;
  void drive_shared(std::size_t link, double fraction, RobotBody& robot);
  void start_trajectory(std::size_t axis, double goal_rad);
  // the servos of hinges, from those of their joints
  void set_hinge_gains();
  void publish();
  Status check_joint(int part, int joint) const;
  Status check_positions(int part, std::span<const double> position_rad) const;

  std::vector<PartInfo> parts_;
  std::vector<std::size_t> first_axis_;
  std::vector<Axis> axis_info_;
  std::vector<AxisState> axes_;
  std::vector<Hinge> hinges_;  // by link
  // rows of the pseudo-inverse: axis = sum of factor * (hinge angle - offset)
  std::vector<std::vector<std::pair<std::size_t, double>>> inverse_;
  std::vector<double> gravity_Nm_;       // by link, at the begin of the period
  std::vector<double> hinge_torque_Nm_;  // by link, summed over the steps of the period, then its mean
  int steps_ = 0;
  double period_s_ = 0.01;
  std::vector<std::vector<JointState>> measured_;  // by part, what joints() shows
};

}  // namespace nido::sim
