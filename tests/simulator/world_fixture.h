#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "nido/simulator/simulation.h"

namespace nido::sim {

inline std::string config(const std::string& file) { return std::string(NIDO_CONFIG_DIR) + "/" + file; }

// The robot over the floor, nothing else.
inline SimulationOptions robot_only() {
  SimulationOptions options;
  options.urdf_path = config("robots/icub.urdf");
  return options;
}

inline SimulationOptions with_world(const std::string& name) {
  SimulationOptions options = robot_only();
  options.world_path = config("worlds/" + name + ".yaml");
  return options;
}

inline std::unique_ptr<Simulation> make(const SimulationOptions& options) {
  auto made = Simulation::create(options);
  if (!made) {
    ADD_FAILURE() << made.error().message;
    std::abort();
  }
  return std::move(made.value());
}

inline std::unique_ptr<Simulation> make_yaml(const std::string& world_yaml) {
  SimulationOptions options = robot_only();
  options.world_yaml = world_yaml;
  return make(options);
}

}  // namespace nido::sim
