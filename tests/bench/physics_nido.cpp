#include "physics_scene.h"

namespace nido::bench {
namespace {

class NidoContender : public Contender {
 public:
  NidoContender(const PhysicsScene& scene, std::unique_ptr<sim::Simulation> simulation)
      : scene_(scene), simulation_(std::move(simulation)) {}

  [[nodiscard]] std::string name() const override { return "nido"; }

  Status advance(const Eigen::VectorXd& axes_rad) override {
    for (const Part& part : scene_.model().parts()) {
      const int index = simulation_->part_index(part.name);
      const std::span<const double> targets(axes_rad.data() + part.first_axis, part.axes.size());
      if (Status ok = simulation_->command_all(index, sim::JointMode::kDirect, targets); !ok) return ok;
    }
    return simulation_->step();
  }

  [[nodiscard]] int contacts() const override { return static_cast<int>(simulation_->contacts().size()); }

 private:
  const PhysicsScene& scene_;
  std::unique_ptr<sim::Simulation> simulation_;
};

}  // namespace

Result<std::unique_ptr<Contender>> make_nido(const PhysicsScene& scene) {
  sim::SimulationOptions options;
  options.urdf_path = scene.urdf_path();
  options.world_yaml = scene.world_yaml();
  auto made = sim::Simulation::create(options);
  if (!made) return made.error();
  for (const Thing& thing : scene.things()) {
    // the world port's frame: x left, y up, z forward, from the floor
    const Eigen::Vector3d p(-thing.p_Root_m.y(), thing.p_Root_m.z() - sim::Simulation::kFloorHeight_m,
                            -thing.p_Root_m.x() - 0.026);
    const auto text = [](const Eigen::Vector3d& v) {
      return " " + std::to_string(v.x()) + " " + std::to_string(v.y()) + " " + std::to_string(v.z());
    };
    const std::string kind = thing.ball ? "sph" : "box";
    const std::string size = thing.ball ? " " + std::to_string(thing.size_m.x()) : text(thing.size_m);
    const std::string count = (*made)->world("world num " + kind);
    const std::string reply = (*made)->world("world mk " + kind + size + text(p) + " 0.8 0.2 0.2");
    if (reply != "[ok]") return Error{ErrorCode::kFailed, reply};
    const std::string mass =
        (*made)->world("world mass " + kind + " " + std::to_string(std::stoi(count) + 1) + " " +
                       std::to_string(thing.mass_kg));
    if (mass != "[ok]") return Error{ErrorCode::kFailed, mass};
  }
  return std::unique_ptr<Contender>(std::make_unique<NidoContender>(scene, std::move(*made)));
}

}  // namespace nido::bench
