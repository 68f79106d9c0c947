#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "nido/interfaces/result.h"
#include "nido/launcher/app.h"
#include "nido/launcher/paths.h"

namespace nido {

// What a run leaves behind: OUT/app.yaml, OUT/nodes/NAME.yaml, OUT/logs/NAME.log, and what the judge writes.
struct RunFolder {
  std::filesystem::path path;  // absolute
};

// Makes the folder. `wanted` empty: out/TIME-APP below the current folder, and out/latest becomes a link to
// it.
Result<RunFolder> make_run_folder(const App& app, const std::string& wanted);

// Settings of a run that the app file leaves open, found by the launcher.
struct RunSettings {
  int domain = 0;
  std::filesystem::path robot_file;
  std::filesystem::path world_file;
};

// Writes OUT/nodes/NAME.yaml for a process: what Node::options_from_args reads with --node. Returns its path.
Result<std::filesystem::path> write_node_file(const App& app, const AppProcess& process,
                                              const RunSettings& settings, const Places& places,
                                              const RunFolder& folder);

}  // namespace nido
