// libFuzzer on what the simulator reads: lines of the world port, worlds, robots, meshes. The first byte says
// which. Nothing may crash, hang or be refused without a sentence.
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
#include "shapes.h"

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
  return (std::filesystem::temp_directory_path() / ("nido_fuzz_" + std::to_string(getpid()) + suffix))
      .string();
}

void write(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

// A world full of things, as rough as the lines want it; a new one now and then.
void talk(const std::string& text) {
  static std::unique_ptr<Simulation> simulation;
  static int talks = 0;
  if (!simulation || ++talks % 200 == 0) simulation = std::move(Simulation::create(robot()).value());
  std::istringstream lines(text);
  std::string line;
  for (int i = 0; i < 40 && std::getline(lines, line, '\n'); ++i) {
    // files are another target's
    if (line.find("mdir") != std::string::npos || line.find("mod") != std::string::npos) continue;
    require(!simulation->world(line).empty(), "no reply to: " + line);
  }
  if (const nido::Status done = simulation->step(); !done) {
    require(!done.error().message.empty(), "a failure without a sentence");
    simulation->reset();
  }
}

void read_world(const std::string& text) {
  SimulationOptions options = robot();
  options.world_yaml = text;
  const auto made = Simulation::create(options);
  if (!made) require(!made.error().message.empty(), "a world refused without a sentence");
}

void read_robot(const std::string& text) {
  const auto model = nido::RobotModel::parse(text, "fuzz");
  if (!model) require(!model.error().message.empty(), "a robot refused without a sentence");
  SimulationOptions options;
  options.urdf_path = temporary(".urdf");
  write(options.urdf_path.string(), text);
  auto made = Simulation::create(options);
  if (!made) {
    require(!made.error().message.empty(), "a robot refused without a sentence");
  } else if (const nido::Status done = (*made)->step(); !done) {
    require(!done.error().message.empty(), "a failure without a sentence");
  }
}

void read_mesh(const std::string& text, const char* suffix) {
  const std::string path = temporary(suffix);
  write(path, text);
  const auto mesh = nido::sim::load_mesh(path, Eigen::Vector3d::Ones());
  if (!mesh) {
    require(!mesh.error().message.empty(), "a mesh refused without a sentence");
    return;
  }
  static std::unique_ptr<Simulation> simulation = std::move(Simulation::create(robot()).value());
  const auto folder = std::filesystem::temp_directory_path().string();
  simulation->world("world set mdir " + folder);
  simulation->world("world mk model " + std::filesystem::path(path).filename().string() + " none 0 1 0.5");
  if (!simulation->step(0.02).ok()) simulation->reset();
  simulation->world("world del all");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
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
    default:
      talk(text);
      break;
  }
  return 0;
}
