#include "nido/launcher/paths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "nido/launcher/suggest.h"

namespace nido {
namespace fs = std::filesystem;

Result<Places> find_places() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (error) return Error{ErrorCode::kNotFound, "/proc/self/exe cannot be read: is /proc mounted?"};
  Places places;
  places.programs = self.parent_path();
  if (const char* folder = std::getenv("NIDO_CONFIG_DIR"); folder != nullptr && *folder != '\0') {
    if (!fs::is_directory(fs::path(folder) / "apps", error)) {
      return Error{ErrorCode::kNotFound,
                   fmt::format("NIDO_CONFIG_DIR is {}, but there is no folder apps in it", folder)};
    }
    places.config = fs::absolute(folder);
    return places;
  }
  for (const fs::path& candidate :
       {places.programs / "../../config", places.programs / "../share/nido/config",
        fs::path(NIDO_SOURCE_DIR) / "config"}) {
    if (fs::is_directory(candidate / "apps", error)) {
      places.config = fs::canonical(candidate);
      return places;
    }
  }
  return Error{ErrorCode::kNotFound,
               fmt::format("the config folder is not found from {}: set NIDO_CONFIG_DIR to it",
                           places.programs.string())};
}

namespace {

// Beside the robot files lie others about the robot's body.
bool is_robot_file(const fs::path& file) {
  std::ifstream text(file);
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("robot:")) return true;
  }
  return false;
}

}  // namespace

std::vector<std::string> config_names(const Places& places, const std::string& subfolder) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(places.config / subfolder, error)) {
    if (entry.path().extension() != ".yaml") continue;
    if (subfolder == "robots" && !is_robot_file(entry.path())) continue;
    names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

Result<fs::path> find_config(const Places& places, const std::string& subfolder, const std::string& what,
                             const std::string& name_or_file) {
  std::error_code error;
  const fs::path given(name_or_file);
  if (name_or_file.find('/') != std::string::npos || given.extension() == ".yaml") {
    if (fs::is_regular_file(given, error)) return fs::canonical(given);
    if (!given.is_absolute() && fs::is_regular_file(places.config / given, error))
      return fs::canonical(places.config / given);
    return Error{ErrorCode::kNotFound, fmt::format("there is no {} file {}", what, name_or_file)};
  }
  const fs::path named = places.config / subfolder / (name_or_file + ".yaml");
  if (fs::is_regular_file(named, error)) return fs::canonical(named);
  const auto names = config_names(places, subfolder);
  const std::string near = nearest_word(name_or_file, names);
  return Error{ErrorCode::kNotFound,
               fmt::format("there is no {} '{}' in {}{}; there are: {}", what, name_or_file,
                           (places.config / subfolder).string(),
                           near.empty() ? "" : fmt::format("; did you mean '{}'?", near), join_words(names))};
}

}  // namespace nido
