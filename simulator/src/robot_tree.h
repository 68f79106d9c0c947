#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "robot_description.h"

namespace nido::sim {

// The robot's motion in joint coordinates: links that hang on each other by hinges cannot come apart, and a
// step costs what a robot's structure asks, not what its number of constraints does. A limb is everything
// beyond one hinge of the fixed root; limbs do not feel each other, and a limb at rest costs nothing. A robot
// whose base is free is one limb, since all of it hangs on the base's six degrees of freedom.
//
// The equations of one step are H' v = b, where H' is the mass matrix with the motors' stiffness on its
// diagonal. With H' = L^T D L (Featherstone, Rigid Body Dynamics Algorithms, chapter 6: L has the sparsity of
// the tree) every constraint row J becomes z = D^(-1/2) L^(-T) J^T, nonzero only along the hinges between
// root and link, and the motion is y = D^(1/2) L v: a row's speed is z . y and an impulse p on it adds z p to
// y.
class RobotTree {
 public:
  // What the motor of a hinge wants in this step: a speed, with at most this torque. One that gives all its
  // torque falls short of its speed by `give_way_rad_s`, one that gives half of it by half of that.
  struct Motor {
    double speed_rad_s = 0;
    double most_torque_Nm = 0;
    double give_way_rad_s = 0.005;
  };

  explicit RobotTree(const RobotDescription& description);

  [[nodiscard]] std::size_t link_count() const { return links_.size(); }
  [[nodiscard]] std::size_t limb_count() const { return limbs_.size(); }
  [[nodiscard]] std::size_t limb_of(std::size_t link) const { return links_[link].limb; }
  // First link of a limb and the one behind its last: links are numbered so that a limb is a range.
  [[nodiscard]] std::pair<std::size_t, std::size_t> limb(std::size_t index) const { return limbs_[index]; }
  // Hinges between root and link, the root's first, the link's own last. By the links that they move.
  [[nodiscard]] std::span<const int> path(std::size_t link) const { return links_[link].path; }

  // -- the state: angles and speeds of the hinges, by link (0 unused). Of a free base's links the first three
  // hold where the base is (m) and how fast it moves (m/s), the last three its orientation as a rotation
  // vector and its turn rate, all along the world's axes.
  [[nodiscard]] double angle_rad(std::size_t link) const { return angle_rad_[link]; }
  [[nodiscard]] double speed_rad_s(std::size_t link) const { return speed_rad_s_[link]; }
  void set(std::size_t link, double angle_rad, double speed_rad_s);
  // Poses and velocities of all links of a limb from its angles and speeds; after set().
  void update(std::size_t limb);

  // -- poses in the world
  [[nodiscard]] const Eigen::Quaterniond& q_WorldLink(std::size_t link) const { return links_[link].q; }
  [[nodiscard]] const Eigen::Matrix3d& R_WorldLink(std::size_t link) const { return links_[link].R; }
  [[nodiscard]] const Eigen::Vector3d& p_WorldLink_m(std::size_t link) const { return links_[link].p; }
  [[nodiscard]] const Eigen::Vector3d& p_WorldCom_m(std::size_t link) const { return links_[link].c; }
  // Zero where the link slides.
  [[nodiscard]] const Eigen::Vector3d& axis_World(std::size_t link) const { return links_[link].a; }
  // How fast a point that the link moves goes along a direction while the link's hinge has the speed one; the
  // same for turning about the direction.
  [[nodiscard]] double move_along(std::size_t link, const Eigen::Vector3d& p_World_m,
                                  const Eigen::Vector3d& direction_World) const {
    const Link& l = links_[link];
    if (l.freedom == Freedom::kBaseSlide) return l.s.dot(direction_World);
    return l.a.dot((p_World_m - l.p).cross(direction_World));
  }
  [[nodiscard]] double turn_along(std::size_t link, const Eigen::Vector3d& direction_World) const {
    return links_[link].a.dot(direction_World);
  }
  [[nodiscard]] const Eigen::Vector3d& w_World_rad_s(std::size_t link) const { return links_[link].w; }
  [[nodiscard]] Eigen::Vector3d v_WorldCom_m_s(std::size_t link) const {
    return links_[link].v0 + links_[link].w.cross(links_[link].c);
  }

  // -- one step
  void set_motor(std::size_t link, const Motor& motor) { motor_[link] = motor; }
  // What acts on a degree of freedom of the base, which has no motor, until the next call: N or N m.
  void set_base_force(std::size_t link, double force) { base_force_[link] = force; }
  // The gear turns no faster, whatever flings the hinge. Any speed until this is said.
  void set_top_speed(std::size_t link, double speed_rad_s) { top_speed_rad_s_[link] = speed_rad_s; }
  // Mass matrix and forces of the limb as it moves now.
  void begin(std::size_t limb, double step_s);
  // Factors and solves with the motors' present states; y() then is the motion without constraints. Called
  // again when motors came to their torque or off it.
  void solve(std::size_t limb);
  [[nodiscard]] std::vector<double>& y() { return y_; }  // by link
  // Turns a constraint's direction into its row: `row` holds J at the hinges of `path`, which names for every
  // hinge also all those between it and the root.
  void half_solve(std::span<const int> path, double* row) const;
  // The same for two links' paths one behind the other: the second begins at `tail` and leaves out the
  // `shared` hinges that both have.
  void half_solve(std::span<const int> path, std::size_t tail, std::size_t shared, double* row) const;
  // Speeds from y. True when all motors are in the state that fits; else their states have been changed and
  // the limb wants another solve().
  bool settle(std::size_t limb, bool last);
  // Moves on by the speeds.
  void advance(std::size_t limb, double step_s);
  // What the motor exerted in the last step, friction and stiffness included, the stops not.
  [[nodiscard]] double motor_torque_Nm(std::size_t link) const { return torque_Nm_[link]; }
  // At rest: no speed, no torque.
  void rest(std::size_t limb);

  // Everything that changes from step to step.
  struct State {
    std::vector<double> angle_rad;
    std::vector<double> speed_rad_s;
    std::vector<int> at_torque;
  };
  [[nodiscard]] State save() const { return {angle_rad_, speed_rad_s_, at_torque_}; }
  void restore(const State& state);

 private:
  struct Link {
    Freedom freedom = Freedom::kHinge;
    int parent = 0;
    std::size_t limb = 0;
    std::size_t depth = 0;  // hinges between root and this one
    std::vector<int> path;
    Eigen::Quaterniond q_ParentLink;
    Eigen::Vector3d p_ParentLink;
    Eigen::Vector3d axis_Link;
    Eigen::Vector3d com_Link;
    double mass = 0;
    Eigen::Matrix3d inertia_Com;  // about the centre of mass, link's axes
    // in the world
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Vector3d p = Eigen::Vector3d::Zero();   // a point of the hinge's axis
    Eigen::Vector3d a = Eigen::Vector3d::UnitZ();  // the axis
    Eigen::Vector3d s =
        Eigen::Vector3d::Zero();  // what the hinge's turning moves at the world's origin: p x a
    Eigen::Vector3d c = Eigen::Vector3d::Zero();   // centre of mass
    Eigen::Vector3d w = Eigen::Vector3d::Zero();   // turning
    Eigen::Vector3d v0 = Eigen::Vector3d::Zero();  // velocity of the link's point at the world's origin
  };
  // Masses of a link and all beyond, about the world's origin, and what moves them.
  struct Beyond {
    double mass = 0;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
    Eigen::Vector3d turn_momentum = Eigen::Vector3d::Zero();
    Eigen::Vector3d momentum = Eigen::Vector3d::Zero();
    Eigen::Vector3d turn_force = Eigen::Vector3d::Zero();
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    Eigen::Vector3d turn_acceleration = Eigen::Vector3d::Zero();
    Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
  };

  void update_base(std::size_t link);
  // The base's orientation after a step with its turn rate.
  void turn_base(double step_s);
  [[nodiscard]] double stiffness(std::size_t link) const;

  std::vector<Link> links_;
  std::vector<std::pair<std::size_t, std::size_t>> limbs_;
  std::size_t stride_ = 0;  // longest path
  std::vector<double> angle_rad_, speed_rad_s_, torque_Nm_, top_speed_rad_s_;
  std::vector<double> least_rad_, most_rad_;  // what no push gets a hinge beyond
  std::vector<Motor> motor_;
  std::vector<double> base_force_;
  std::vector<int> at_torque_;  // -1, 1: the motor gives all its torque that way; 0: it keeps its speed
  std::vector<Beyond> beyond_;
  std::vector<double> mass_matrix_;  // row of a link: entries along its path
  std::vector<double> factor_;       // L, with D^(-1/2) in the last entry
  std::vector<double> push_;         // momentum and forces without motors, by link
  std::vector<double> y_;
  double step_s_ = 0.001;
};

}  // namespace nido::sim
