#pragma once

// The simulated head as a rig; apart from rigs.h because it needs the simulator.

#include <filesystem>

#include "nido/simulator/devices/simulated_control_board.h"
#include "nido/simulator/devices/simulated_robot.h"
#include "rigs.h"

namespace nido::test {

inline std::shared_ptr<sim::SimulatedRobot> simulated_robot(const std::string& world_yaml = "") {
  sim::SimulationOptions options;
  options.urdf_path = std::filesystem::path(NIDO_CONFIG_DIR) / "robots" / "icub.urdf";
  options.world_yaml = world_yaml;
  return required(sim::SimulatedRobot::create(options, {}));
}

class SimulatedRig final : public LocalRig {
 public:
  int free_joint() override {
    return 2;
  }  // neck_yaw: turns about the vertical, so that gravity does not matter
  double tolerance_rad() override { return 0.03; }

 protected:
  IControlBoard& device() override { return *board_; }
  Status step(std::int64_t now_ns) override { return robot_->step_to(now_ns); }

 private:
  std::shared_ptr<sim::SimulatedRobot> robot_ = simulated_robot();
  std::unique_ptr<IControlBoard> board_ = required(sim::SimulatedControlBoard::create(robot_, "head"));
};

}  // namespace nido::test
