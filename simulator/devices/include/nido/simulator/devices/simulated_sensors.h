#pragma once

#include <memory>
#include <string>

#include "nido/interfaces/inertial.h"
#include "nido/interfaces/touch.h"
#include "nido/interfaces/world.h"
#include "nido/simulator/devices/simulated_robot.h"

namespace nido::sim {

// The touch pads of a simulated hand. Thread-safe.
class SimulatedTouch final : public ITouch {
 public:
  SimulatedTouch(std::shared_ptr<SimulatedRobot> robot, Hand hand) : robot_(std::move(robot)), hand_(hand) {}
  [[nodiscard]] int pads() const override { return static_cast<int>(kPadCount); }
  [[nodiscard]] Result<TouchReading> read_touch() const override;

 private:
  std::shared_ptr<SimulatedRobot> robot_;
  Hand hand_;
};

// The simulated world, by text. Thread-safe.
class SimulatedWorld final : public IWorld {
 public:
  explicit SimulatedWorld(std::shared_ptr<SimulatedRobot> robot) : robot_(std::move(robot)) {}
  std::string command(const std::string& line) override;

 private:
  std::shared_ptr<SimulatedRobot> robot_;
};

// The force/torque sensor of a simulated limb. Thread-safe.
class SimulatedForceTorque final : public IForceTorque {
 public:
  // limb: "left_arm", "right_arm", "left_leg", "right_leg".
  static Result<std::unique_ptr<SimulatedForceTorque>> create(std::shared_ptr<SimulatedRobot> robot,
                                                              const std::string& limb);
  [[nodiscard]] Result<WrenchReading> read_wrench() const override;

 private:
  SimulatedForceTorque(std::shared_ptr<SimulatedRobot> robot, std::string limb)
      : robot_(std::move(robot)), limb_(std::move(limb)) {}
  std::shared_ptr<SimulatedRobot> robot_;
  std::string limb_;
};

// The inertial sensor in the simulated head. Thread-safe.
class SimulatedInertial final : public IInertial {
 public:
  explicit SimulatedInertial(std::shared_ptr<SimulatedRobot> robot) : robot_(std::move(robot)) {}
  [[nodiscard]] Result<InertialReading> read_inertial() const override;

 private:
  std::shared_ptr<SimulatedRobot> robot_;
};

}  // namespace nido::sim
