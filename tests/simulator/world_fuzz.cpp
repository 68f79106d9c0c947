// libFuzzer on what the simulator reads: lines of the world port, worlds, robots, meshes, snapshots. The
// first byte says which. Nothing may crash, hang or be refused without a sentence. No physics is stepped:
// that is tests/simulator/adversary.cpp.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>

#include "nido/kinematics/robot_model.h"
#include "nido/simulator/simulation.h"
#include "ode_library.h"
#include "robot_description.h"
#include "simulation_impl.h"
#include "skin.h"

namespace {

using nido::sim::Simulation;
using nido::sim::SimulationOptions;

void require(bool holds, const std::string& what) {
  if (holds) return;
  std::cerr << what << '\n';
  std::abort();
}

SimulationOptions robot() {
  SimulationOptions options;
  options.urdf_path = std::string(NIDO_CONFIG_DIR) + "/robots/icub.urdf";
  return options;
}

std::string temporary(const char* suffix) {
  return (std::filesystem::path("/dev/shm") / ("nido_fuzz_" + std::to_string(getpid()) + suffix)).string();
}

void write(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

// A world full of things; a new one now and then.
void talk(const std::string& text) {
  static std::unique_ptr<Simulation> simulation;
  static int talks = 0;
  if (!simulation || ++talks % 5000 == 0) {
    SimulationOptions options = robot();
    options.scene_folder = temporary("_scenes");
    simulation = std::move(Simulation::create(options).value());
  }
  std::istringstream lines(text);
  std::string line;
  for (int i = 0; i < 40 && std::getline(lines, line, '\n'); ++i) {
    // the disk is not what is tried here
    if (line.find("mdir") != std::string::npos || line.find("save") != std::string::npos ||
        line.find("file") != std::string::npos)
      continue;
    require(!simulation->world(line).empty(), "no reply to: " + line);
  }
}

void read_world(const std::string& text) {
  SimulationOptions options = robot();
  options.world_yaml = text;
  const auto read = nido::sim::read_world(options);
  if (!read) {
    require(!read.error().message.empty(), "a world refused without a sentence");
    return;
  }
  // whatever is taken can be built
  static nido::sim::OdeWorld ode;
  nido::sim::ObjectList made;
  for (const auto& object : read->objects)
    made.push_back(std::make_unique<nido::sim::ObjectBody>(ode.id(), object));
  for (const auto& joint : read->joints) (void)nido::sim::make_joint(joint, made);
}

void read_robot(const std::string& text) {
  const auto model = nido::RobotModel::parse(text, "fuzz");
  if (!model) require(!model.error().message.empty(), "a robot refused without a sentence");
  const std::string path = temporary(".urdf");
  write(path, text);
  const auto read = nido::sim::read_robot(path);
  if (!read) require(!read.error().message.empty(), "a robot refused without a sentence");
  if (!model) return;
  const auto skin = nido::sim::read_skin(*model, path);
  if (!skin) require(!skin.error().message.empty(), "a skin refused without a sentence");
}

void read_mesh(const std::string& text, const char* suffix) {
  const std::string path = temporary(suffix);
  write(path, text);
  const auto mesh = nido::sim::load_mesh(path, Eigen::Vector3d::Ones());
  if (!mesh) {
    require(!mesh.error().message.empty(), "a mesh refused without a sentence");
    return;
  }
  static nido::sim::OdeWorld ode;
  nido::sim::ObjectDescription object =
      nido::sim::make_simple("thing", "model", nido::sim::ShapeKind::kMesh, Eigen::Vector3d::Ones(), 1, {});
  object.shapes[0].mesh = *mesh;
  const nido::sim::ObjectBody body(ode.id(), std::move(object));
}

void read_snapshot(const std::string& text) {
  nido::sim::StateShape shape;
  shape.hinges = {"hinge"};
  shape.joints = 1;
  const auto read = nido::sim::read_snapshot(text, shape, "fuzz");
  if (!read) require(!read.error().message.empty(), "a snapshot refused without a sentence");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  nido::sim::prepare_ode();
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0]) {
    case 'y':
      read_world(text);
      break;
    case 'r':
      read_robot(text);
      break;
    case 'o':
      read_mesh(text, ".obj");
      break;
    case 's':
      read_mesh(text, ".stl");
      break;
    case 'j':
      read_snapshot(text);
      break;
    default:
      talk(text);
      break;
  }
  return 0;
}
