#pragma once

// The simulated left eye and right hand with their time, as they are or to be served.

#include "nido/simulator/devices/simulated_camera.h"
#include "nido/simulator/devices/simulated_sensors.h"
#include "sensor_contracts.h"
#include "simulated_rig.h"

namespace nido::test {

class SimulatedCameraRig final : public CameraRig {
 public:
  ICamera& camera() override { return *camera_; }
  void advance() override {
    const Status stepped = robot_->step_to(robot_->now_ns() + kPeriod_ns);
    if (!stepped) throw std::runtime_error(stepped.error().message);
  }
  const IClock& clock() const { return *robot_; }

 private:
  std::shared_ptr<sim::SimulatedRobot> robot_ = simulated_robot();
  std::unique_ptr<ICamera> camera_ = required(sim::SimulatedCamera::create(robot_, sim::Eye::kLeft, {}));
};
// A small box is laid on the back of the hand, whose pad is the whole palm, and taken away again.
class SimulatedTouchRig final : public TouchRig {
 public:
  ITouch& touch() override { return touch_; }
  void advance() override {
    const Status stepped = robot_->step_to(robot_->now_ns() + kPeriod_ns);
    if (!stepped) throw std::runtime_error(stepped.error().message);
  }
  bool press(int pad, bool pressed) override {
    if (pad != 5) return false;
    sim::SimulatedWorld world(robot_);
    if (!pressed) return world.command("world del box 1") == "[ok]";
    const Eigen::Isometry3d X_WorldPalm = required(robot_->simulation().X_WorldLink("r_hand"));
    // a little above the hand; the port's frame: x left, y up, z forward, origin on the floor
    const Eigen::Vector3d p_World_m = X_WorldPalm.translation() + Eigen::Vector3d(0, 0, 0.05);
    return world.command("world mk box 0.04 0.02 0.04 " + std::to_string(-p_World_m.y()) + " " +
                         std::to_string(p_World_m.z() + 0.5976) + " " +
                         std::to_string(-p_World_m.x() - 0.026) + " 1 0 0") == "[ok]";
  }
  const IClock& clock() const { return *robot_; }

 private:
  std::shared_ptr<sim::SimulatedRobot> robot_ = simulated_robot();
  sim::SimulatedTouch touch_{robot_, sim::Hand::kRight};
};

}  // namespace nido::test
