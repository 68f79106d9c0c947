#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <optional>
#include <string>

#include "nido/interfaces/result.h"
#include "nido/middleware/node.h"
#include "src/device_registry.h"

namespace nido {

// The parameters of the process, as the launcher or the command line gives them.
struct RobotSettings {
  std::filesystem::path robot_file;
  std::optional<double> rate;           // simulated seconds per second; none: as fast as possible
  bool window = false;                  // on this computer's display
  bool is_paused = false;               // time begins when somebody says so (nido clock run)
  std::filesystem::path start_from;     // snapshot to go on from; empty: from the beginning
  std::filesystem::path snapshot_file;  // where a snapshot is kept, at snapshot_at_s; empty: nowhere
  std::int64_t snapshot_at_s = 0;
  RunSettings run;
};

// Reads and checks the parameters; robot and world may be names of files in config/. kInvalidArgument and
// kNotFound say what is wrong and what there is.
Result<RobotSettings> read_settings(const YAML::Node& parameters, std::uint64_t seed);
// Shows them to people (nido param list robot): each with its value and what is said of it. They hold from
// the start on; what changes while the robot runs has a port (/icubSim/world, /clock/rpc:i).
void list_settings(Node& node);

}  // namespace nido
