#pragma once

#include <ode/ode.h>

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "robot_body.h"
#include "row_kernels.h"

namespace nido::sim {

// Moves robot and objects through one physics step: motors, stops and contacts at once, then positions by the
// new speeds (semi-implicit Euler). Hinges hold exactly, since the robot moves in joint coordinates; contacts
// are met by projected Gauss-Seidel, forwards and backwards in turn, in the order in which they are given: no
// chance is involved, so the same state has the same future.
class ContactSolver {
 public:
  // A link of the robot, a free object, or (neither) what never moves.
  struct Side {
    int link = 0;
    int object = -1;
  };
  struct Contact {
    Side a;
    Side b;
    Eigen::Vector3d p_World_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal_World = Eigen::Vector3d::UnitZ();  // towards a
    double depth_m = 0;
    // it gives way: J v + cfm * force = erp * depth / step
    double erp = 0.4;
    double cfm = 1e-7;
    double friction = 0;
    double restitution = 0;
    double slowest_bounce_m_s = 0.05;
    double twist_m = 0;    // resists turning about the normal with force times this
    double rolling_m = 0;  // and about the tangents with this
    // first tangent, a unit vector, and the speed along it that friction is to reach; zero: any tangent, no
    // speed
    Eigen::Vector3d tangent_World = Eigen::Vector3d::Zero();
    double tangent_speed_m_s = 0;
    // on a, at the point: before the step what to start from (that of the step before, or zero), after it
    // what came of it
    Eigen::Vector3d force_World_N = Eigen::Vector3d::Zero();
    Eigen::Vector3d torque_World_Nm = Eigen::Vector3d::Zero();
    double normal_force_N = 0;
  };

  // Two free objects, or one and what never moves (-1), that stay together at a point, and do not turn
  // against each other about some axes.
  struct Tie {
    int object_a = -1;
    int object_b = -1;
    Eigen::Vector3d p_World_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d gap_m = Eigen::Vector3d::Zero();  // from a's point to b's
    std::size_t turns = 0;                            // axes that are held: 0, 2 or 3
    std::array<Eigen::Vector3d, 3> turn_axis_World{};
    std::array<double, 3> turn_gap_rad{};  // what a must turn by
    // before the step what to start from, after it what came of it
    std::array<double, 6> impulse{};
  };

  // `objects`: bodies of the free objects by index, nullptr for those that never move. Sleeping (disabled)
  // ones stay where they are. The bodies' collected forces are used up.
  void step(RobotBody& robot, const std::vector<dBodyID>& objects, std::vector<Contact>& contacts,
            std::vector<Tie>& ties, double step_s, int iterations);

 private:
  // What a free object is during a step. Its speeds are kept as a robot's are, times the root of what is
  // moved: u = sqrt(m) v and u = L^T w, where the inertia is L L^T. So one row tells both how an impulse
  // changes them and what it feels of them.
  struct Free {
    double root_mass = 0;
    Eigen::Matrix3d inverse_root_inertia = Eigen::Matrix3d::Zero();  // L^-1
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    double u[6] = {};  // linear, angular; forces of the step included
    Eigen::Vector3d v_before = Eigen::Vector3d::Zero();
    Eigen::Vector3d w_before = Eigen::Vector3d::Zero();
    bool moves = false;
  };
  struct Row {
    double target = 0;  // speed
    double give = 0;    // cfm by step
    double weight = 0;  // effective inverse mass and give
    double inverse = 0;
    // how far the impulse may go, as a share of the first row's; kPushes: 0 to infinity, kHolds: anything
    double share = 0;
    double impulse = 0;
    double others[kMostRowsOfGroup] = {};  // what a unit impulse changes in the speed of the group's rows
  };
  // Rows of one contact or stop; they share their links and objects.
  struct Group {
    std::size_t path = 0;  // first in paths_
    std::size_t length = 0;
    std::size_t tail =
        0;  // where the second link's path begins, and how many hinges it shares with the first
    std::size_t shared = 0;
    // first in directions_ and coupled_: for every row `width` numbers, those of the hinges, of the objects
    // (six each), and zeros to fill up
    std::size_t directions = 0;
    std::size_t width = 0;
    std::size_t row = 0;
    std::size_t rows = 0;
    int object_a = -1;
    int object_b = -1;
    Eigen::Vector3d p_World_m = Eigen::Vector3d::Zero();
    bool link_a = false;  // the robot is on side a, on side b
    bool link_b = false;
    Contact* contact = nullptr;
    Tie* tie = nullptr;
  };
  static constexpr double kPushes = -1;
  static constexpr double kHolds = -2;

  void gather_objects(const std::vector<dBodyID>& objects, double step_s);
  void add_stops(const RobotBody& robot, double step_s);
  void add_contact(const RobotTree& tree, Contact& contact, double step_s);
  void add_tie(const RobotTree& tree, Tie& tie, double step_s);
  // Calls what(numbers of the object, its place in the rows) for both objects of a group that move.
  template <typename What>
  void for_objects(const Group& group, What&& what) {
    std::size_t at = padded(group.length);
    for (const int object : {group.object_a, group.object_b}) {
      if (object < 0) continue;
      what(free_[static_cast<std::size_t>(object)].u, at);
      at += 6;
    }
  }
  static void set_width(Group& group);
  // What the rows of a group began with acts on its objects.
  void begin_with_impulses(const Group& group);
  // A row about a line (linear) or an axis (angular) of the group.
  Row& add_row(const RobotTree& tree, Group& group, const Eigen::Vector3d& direction, bool turning);
  void couple(RobotTree& tree);
  void iterate(RobotTree& tree, int iterations);
  // Returns the largest change of speed.
  double relax(RobotTree& tree, const Group& group);
  void read_forces(double step_s);
  void move_objects(const std::vector<dBodyID>& objects, double step_s);

  std::vector<Free> free_;
  std::vector<Group> groups_;
  std::vector<Row> rows_;
  std::vector<int> paths_;
  std::vector<double> directions_;  // J at the hinges, what the rows are at the objects
  std::vector<double> coupled_;     // z
  std::vector<double> near_;        // the speeds that a group acts on
  std::vector<std::size_t> awake_limbs_;
};

}  // namespace nido::sim
