#include "limb_forces.h"

#include <algorithm>

#include "ode_library.h"

namespace nido::sim {

LimbForces::LimbForces(const RobotBody& robot, const ControlBlock& block) {
  const auto& links = robot.description().links;
  for (const auto& [limb, hinge] : block.force_torque) {
    Sensor sensor;
    for (std::size_t i = 1; i < links.size(); ++i) {
      const auto parent = static_cast<std::size_t>(links[i].parent);
      const bool first = links[i].joint_name == hinge;
      if (first) sensor.link = i;
      if (first || std::find(sensor.links.begin(), sensor.links.end(), parent) != sensor.links.end()) {
        sensor.links.push_back(i);
      }
    }
    sensors_.push_back(std::move(sensor));
  }
  restart(robot);
}

LimbForces::Motion LimbForces::motion_of(const RobotBody& robot, std::size_t link) {
  const MassProperties& mass = robot.description().links[link].mass;
  dBodyID body = robot.bodies()[link];
  const Eigen::Matrix3d R = body_pose(body).linear();
  Motion motion;
  motion.momentum = mass.mass_kg * to_eigen(dBodyGetLinearVel(body));
  motion.turn_momentum = R * (mass.inertia_kgm2 * (R.transpose() * to_eigen(dBodyGetAngularVel(body))));
  return motion;
}

LimbForces::State LimbForces::save() const {
  State state{before_, {}};
  for (const Sensor& sensor : sensors_) state.wrenches.push_back(sensor.wrench);
  return state;
}

void LimbForces::restore(const State& state) {
  before_ = state.before;
  for (std::size_t i = 0; i < sensors_.size(); ++i) sensors_[i].wrench = state.wrenches[i];
}

void LimbForces::restart(const RobotBody& robot) {
  before_.assign(robot.link_count(), Motion{});
  for (std::size_t i = 1; i < robot.link_count(); ++i) before_[i] = motion_of(robot, i);
  for (Sensor& sensor : sensors_) sensor.wrench = {};
}

void LimbForces::measure(const RobotBody& robot, const Contacts& contacts, double period_s) {
  for (Sensor& sensor : sensors_) {
    const Eigen::Isometry3d X_WorldSensor = robot.X_WorldLink(sensor.link);
    const Eigen::Vector3d p = X_WorldSensor.translation();
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();
    for (const std::size_t i : sensor.links) {
      const Motion now = motion_of(robot, i);
      const Eigen::Vector3d lever = to_eigen(dBodyGetPosition(robot.bodies()[i])) - p;
      const Eigen::Vector3d own = robot.description().links[i].mass.mass_kg * Eigen::Vector3d(0, 0, -9.81) -
                                  (now.momentum - before_[i].momentum) / period_s;
      force += own;
      torque += lever.cross(own) - (now.turn_momentum - before_[i].turn_momentum) / period_s;
      contacts.force_on_link(i, p, force, torque);
    }
    sensor.wrench.force_N = X_WorldSensor.linear().transpose() * force;
    sensor.wrench.torque_Nm = X_WorldSensor.linear().transpose() * torque;
  }
  for (std::size_t i = 1; i < robot.link_count(); ++i) before_[i] = motion_of(robot, i);
}

}  // namespace nido::sim
