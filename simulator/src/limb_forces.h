#pragma once

#include <vector>

#include "contacts.h"
#include "control_block.h"
#include "robot_body.h"

namespace nido::sim {

// Force/torque sensors: what the links beyond a hinge exert on the body, from their weight, their inertia and
// what they touch.
class LimbForces {
 public:
  LimbForces(const RobotBody& robot, const ControlBlock& block);
  // Forgets the motion before.
  void restart(const RobotBody& robot);
  // After a control period.
  void measure(const RobotBody& robot, const Contacts& contacts, double period_s);
  [[nodiscard]] const Simulation::Wrench& wrench(std::size_t sensor) const { return sensors_[sensor].wrench; }

  struct Motion {
    Eigen::Vector3d momentum = Eigen::Vector3d::Zero();       // N s
    Eigen::Vector3d turn_momentum = Eigen::Vector3d::Zero();  // about the own centre of mass, N m s
  };
  // Everything that changes.
  struct State {
    std::vector<Motion> before;  // by link
    std::vector<Simulation::Wrench> wrenches;
  };
  [[nodiscard]] State save() const;
  void restore(const State& state);

 private:
  struct Sensor {
    std::size_t link = 0;            // first link beyond the sensor; the sensor's frame
    std::vector<std::size_t> links;  // all beyond
    Simulation::Wrench wrench;
  };
  [[nodiscard]] static Motion motion_of(const RobotBody& robot, std::size_t link);

  std::vector<Sensor> sensors_;
  std::vector<Motion> before_;  // by link
};

}  // namespace nido::sim
