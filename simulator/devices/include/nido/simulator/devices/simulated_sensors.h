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

// A patch of a simulated robot's skin: a pad for each value of its port. Thread-safe.
class SimulatedSkin final : public ITouch {
 public:
  // patch: "left_forearm", ...; kNotFound, with the names that exist, for any other.
  static Result<std::unique_ptr<SimulatedSkin>> create(std::shared_ptr<SimulatedRobot> robot,
                                                       const std::string& patch);
  [[nodiscard]] int pads() const override { return static_cast<int>(values_); }
  [[nodiscard]] Result<TouchReading> read_touch() const override;

 private:
  SimulatedSkin(std::shared_ptr<SimulatedRobot> robot, std::size_t patch, std::size_t values)
      : robot_(std::move(robot)), patch_(patch), values_(values) {}

  const std::shared_ptr<SimulatedRobot> robot_;
  const std::size_t patch_;
  const std::size_t values_;
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
