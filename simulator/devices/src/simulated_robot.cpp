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
    : simulation_(std::move(simulation)), darkroom_(std::move(renderer)) {}

void SimulatedRobot::set_clock(ClockCommand clock) {
  const std::lock_guard lock(mutex_);
  clock_ = std::move(clock);
}

Status SimulatedRobot::step_to(std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  while (now_ns_.load() < now_ns) {
    if (Status stepped = simulation_->step(); !stepped) return stepped;
    now_ns_.fetch_add(kControlPeriod_ns);
    scene_.reset();
  }
  return {};
}

Status SimulatedRobot::restore(const std::string& snapshot, const std::string& source, std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  if (Status restored = simulation_->restore_snapshot(snapshot, source); !restored) return restored;
  now_ns_.store(now_ns);
  scene_.reset();
  return {};
}

std::future<Result<Image>> SimulatedRobot::begin_picture(const Camera& camera, Image storage,
                                                         Darkroom::Finish finish) {
  storage.stamp_ns = now_ns_.load();
  return darkroom_.draw(scene(), camera, std::move(storage), std::move(finish));
}

std::future<Result<DepthImage>> SimulatedRobot::begin_depth(const Camera& camera) {
  return darkroom_.measure(scene(), camera);
}

std::shared_ptr<const SceneSnapshot> SimulatedRobot::scene() {
  if (!scene_) {
    auto scene = std::make_shared<SceneSnapshot>();
    simulation_->scene(*scene);
    scene_ = std::move(scene);
  }
  return scene_;
}

}  // namespace nido::sim
