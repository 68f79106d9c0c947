#pragma once

#include "simulated_rig.h"
#include "task_rig.h"

namespace nido::test {

// The right hand and the gaze of the simulated body.
class SimulatedTaskRig : public LocalTaskRig {
 public:
  SimulatedTaskRig() {
    std::array<IControlBoard*, 3> boards{};
    for (std::size_t part = 0; part < kParts.size(); ++part) {
      boards_.push_back(required(sim::SimulatedControlBoard::create(robot_, kParts[part])));
      boards[part] = boards_.back().get();
    }
    put(boards);
  }
  // a body with mass sags under its own weight
  double tolerance_m() override { return 0.006; }
  double tolerance_px() override { return 4; }

 protected:
  Status step(std::int64_t now_ns) override { return robot_->step_to(now_ns); }

 private:
  std::shared_ptr<sim::SimulatedRobot> robot_ = simulated_robot();
  std::vector<std::unique_ptr<IControlBoard>> boards_;
};

}  // namespace nido::test
