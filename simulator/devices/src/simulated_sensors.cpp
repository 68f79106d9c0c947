#include "nido/simulator/devices/simulated_sensors.h"

#include <mutex>
#include <utility>

namespace nido::sim {

Result<TouchReading> SimulatedTouch::read_touch() const {
  const std::lock_guard lock(robot_->mutex());
  const HandTouch& touch = robot_->simulation().touch(hand_);
  TouchReading reading;
  reading.stamp_ns = robot_->now_ns();
  reading.on.assign(touch.on.begin(), touch.on.end());
  reading.force_N.assign(touch.force_N.begin(), touch.force_N.end());
  return reading;
}

Result<std::unique_ptr<SimulatedSkin>> SimulatedSkin::create(std::shared_ptr<SimulatedRobot> robot,
                                                             const std::string& patch) {
  const std::lock_guard lock(robot->mutex());
  const std::vector<SkinPatch>& patches = robot->simulation().skin();
  std::string names;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (patches[i].name == patch)
      return std::unique_ptr<SimulatedSkin>(new SimulatedSkin(robot, i, patches[i].values));
    names += (names.empty() ? "" : ", ") + patches[i].name;
  }
  return Error{ErrorCode::kNotFound, "the robot's description has no patch of skin '" + patch + "'; it has " +
                                         (names.empty() ? "none" : names)};
}

Result<TouchReading> SimulatedSkin::read_touch() const {
  const std::lock_guard lock(robot_->mutex());
  TouchReading reading;
  reading.stamp_ns = robot_->now_ns();
  reading.on.assign(values_, false);
  reading.force_N.assign(values_, 0);
  for (const TaxelForce& taxel : robot_->simulation().skin_touch(patch_)) {
    const auto value = static_cast<std::size_t>(taxel.value);
    reading.on[value] = true;
    reading.force_N[value] = taxel.force_N;
  }
  return reading;
}

std::string SimulatedWorld::command(const std::string& line) {
  std::string request;
  SimulatedRobot::ClockCommand clock;
  std::string answer;
  {
    const std::lock_guard lock(robot_->mutex());
    clock = robot_->clock();
    answer = robot_->simulation().world(line, clock ? &request : nullptr);
    robot_->scene_changed();
  }
  return request.empty() ? answer : clock(request);
}

Result<std::unique_ptr<SimulatedForceTorque>> SimulatedForceTorque::create(
    std::shared_ptr<SimulatedRobot> robot, const std::string& limb) {
  {
    const std::lock_guard lock(robot->mutex());
    const Result<Simulation::Wrench> first = robot->simulation().force_torque(limb);
    if (!first) return first.error();
  }
  return std::unique_ptr<SimulatedForceTorque>(new SimulatedForceTorque(std::move(robot), limb));
}

Result<WrenchReading> SimulatedForceTorque::read_wrench() const {
  const std::lock_guard lock(robot_->mutex());
  const Result<Simulation::Wrench> wrench = robot_->simulation().force_torque(limb_);
  if (!wrench) return wrench.error();
  return WrenchReading{robot_->now_ns(), wrench->force_N, wrench->torque_Nm};
}

Result<InertialReading> SimulatedInertial::read_inertial() const {
  const std::lock_guard lock(robot_->mutex());
  const Simulation::Inertial inertial = robot_->simulation().inertial();
  return InertialReading{robot_->now_ns(), inertial.q_WorldSensor, inertial.acceleration_m_s2,
                         inertial.angular_velocity_rad_s};
}

}  // namespace nido::sim
