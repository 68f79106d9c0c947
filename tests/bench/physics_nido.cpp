#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string_view>

#include "physics_scene.h"

namespace nido::bench {
namespace {

class NidoContender : public Contender {
 public:
  NidoContender(const PhysicsScene& scene, std::string name, std::unique_ptr<sim::Simulation> simulation)
      : scene_(scene), name_(std::move(name)), simulation_(std::move(simulation)) {}

  [[nodiscard]] std::string name() const override { return name_; }

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
  const std::string name_;
  std::unique_ptr<sim::Simulation> simulation_;
};

std::string text(const Eigen::Vector3d& v) {
  return " " + std::to_string(v.x()) + " " + std::to_string(v.y()) + " " + std::to_string(v.z());
}

// The world port's frame: x left, y up, z forward, from the floor.
Eigen::Vector3d on_port(const Eigen::Vector3d& p_Root_m) {
  return {-p_Root_m.y(), p_Root_m.z() - sim::Simulation::kFloorHeight_m, -p_Root_m.x() - 0.026};
}

// The robot's description without its patches of skin, in a file that lives as long as this does.
class SkinlessRobot {
 public:
  explicit SkinlessRobot(const std::filesystem::path& urdf)
      : path_(std::filesystem::temp_directory_path() /
              ("nido-bench-skinless-" + std::to_string(getpid()) + ".urdf")) {
    std::ifstream file(urdf);
    std::ofstream bare(path_);
    const std::string folder = std::filesystem::absolute(urdf).parent_path().string() + "/";
    const std::string_view named = "filename=\"";
    for (std::string line; std::getline(file, line);) {
      if (line.find("skin") != std::string::npos || line.find("<triangle") != std::string::npos) continue;
      if (const auto name = line.find(named); name != std::string::npos)
        line.insert(name + named.size(), folder);
      bare << line << '\n';
    }
  }
  ~SkinlessRobot() {
    std::error_code trouble;
    std::filesystem::remove(path_, trouble);
  }
  SkinlessRobot(const SkinlessRobot&) = delete;
  SkinlessRobot& operator=(const SkinlessRobot&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// A ball a millimetre into the middle of each patch, as the robot stands at the start.
std::vector<std::string> balls_on_the_skin(const sim::Simulation& simulation) {
  constexpr double kBall_m = 0.02;
  constexpr double kPressed_m = 0.001;
  std::vector<std::string> lines;
  for (const sim::SkinPatch& patch : simulation.skin()) {
    const sim::Taxel& taxel = patch.taxels[patch.taxels.size() / 2];
    const Eigen::Vector3d p_Root_m =
        *simulation.X_WorldLink(patch.link) * (taxel.p_Link_m + (kBall_m - kPressed_m) * taxel.out_Link);
    lines.push_back("world mk ssph " + std::to_string(kBall_m) + text(on_port(p_Root_m)) + " 0.8 0.2 0.2");
  }
  return lines;
}

}  // namespace

Result<std::unique_ptr<Contender>> make_nido(const PhysicsScene& scene, const NidoVariant& variant) {
  sim::SimulationOptions options;
  options.urdf_path = scene.urdf_path();
  options.world_yaml = scene.world_yaml();
  options.self_collision = variant.self_collision;
  auto made = sim::Simulation::create(options);
  if (!made) return made.error();
  const std::vector<std::string> balls =
      variant.skin_is_pressed ? balls_on_the_skin(**made) : std::vector<std::string>();
  if (!variant.skin) {
    const SkinlessRobot robot(scene.urdf_path());
    options.urdf_path = robot.path();
    made = sim::Simulation::create(options);
    if (!made) return made.error();
  }
  for (const std::string& ball : balls) {
    if (const std::string reply = (*made)->world(ball); reply != "[ok]")
      return Error{ErrorCode::kFailed, reply};
  }
  for (const Thing& thing : scene.things()) {
    const Eigen::Vector3d p = on_port(thing.p_Root_m);
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
  return std::unique_ptr<Contender>(std::make_unique<NidoContender>(scene, variant.name, std::move(*made)));
}

}  // namespace nido::bench
