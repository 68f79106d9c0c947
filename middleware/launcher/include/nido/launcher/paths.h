#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// Where this installation keeps its programs and its config files.
struct Places {
  std::filesystem::path programs;  // the folder of the running executable
  std::filesystem::path config;    // apps/, robots/, worlds/, ...
};

// Programs: beside the running executable. Config: $NIDO_CONFIG_DIR, or ../../config seen from the programs
// (a build in the source tree), or ../share/nido/config (an installation), or the source tree that this was
// built from.
Result<Places> find_places();

// A config file given as a path (has a slash, or ends in .yaml and exists), or by the name of one in
// config/SUBFOLDER/NAME.yaml. kNotFound names the ones that there are. `what`: "world", for the sentence.
Result<std::filesystem::path> find_config(const Places& places, const std::string& subfolder,
                                          const std::string& what, const std::string& name_or_file);

// Names of the YAML files in a config subfolder, sorted; in robots/ of those that describe a robot.
std::vector<std::string> config_names(const Places& places, const std::string& subfolder);

}  // namespace nido
