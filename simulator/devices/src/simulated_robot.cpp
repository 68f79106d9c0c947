#include "nido/simulator/devices/simulated_robot.h"

#include <utility>

namespace nido::sim {
namespace {

constexpr auto kControlPeriod_ns = static_cast<std::int64_t>(Simulation::kControlPeriod_s * 1e9 + 0.5);

}  // namespace

Result<std::shared_ptr<SimulatedRobot>> SimulatedRobot::create(const SimulationOptions& simulation,
                                                               const RenderOptions& rendering) {
  Result<std::unique_ptr<Simulation>> made = Simulation::create(simulation);
  if (!made) return made.error();
  Result<Renderer> renderer = Renderer::create(rendering);
  if (!renderer) return renderer.error();
  return std::shared_ptr<SimulatedRobot>(new SimulatedRobot(std::move(*made), std::move(*renderer)));
}

SimulatedRobot::SimulatedRobot(std::unique_ptr<Simulation> simulation, Renderer renderer)
    : simulation_(std::move(simulation)), renderer_(std::move(renderer)) {}

Status SimulatedRobot::step_to(std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  while (now_ns_.load() < now_ns) {
    if (Status stepped = simulation_->step(); !stepped) return stepped;
    now_ns_.fetch_add(kControlPeriod_ns);
    scene_is_current_ = false;
  }
  return {};
}

Status SimulatedRobot::render(const Camera& camera, Image& picture) {
  if (!scene_is_current_) {
    simulation_->scene(scene_);
    if (Status set = renderer_.setScene(scene_); !set) return set;
    scene_is_current_ = true;
  }
  return renderer_.render(camera, picture);
}

}  // namespace nido::sim
