#include "condition.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <fstream>

namespace nido {
namespace fs = std::filesystem;

namespace {

constexpr double kHalf = 0.5;          // of the light, less or more
constexpr double kRaise_m = 0.03;      // of the table
constexpr double kNoise_levels = 6.0;  // a small sensor in a dim room

const std::vector<Condition>& known() {
  static const std::vector<Condition> list = {
      {},
      {"dark", kHalf},
      {"bright", 1.0 + kHalf},
      {"raised", 1.0, kRaise_m},
      {"noisy", 1.0, 0.0, kNoise_levels},
      {"degraded", kHalf, kRaise_m, kNoise_levels},
  };
  return list;
}

Status write(const fs::path& path, const YAML::Node& file) {
  std::ofstream out(path);
  out << file << '\n';
  out.close();
  return out ? Status{} : Status{Error{ErrorCode::kFailed, "cannot write " + path.string()}};
}

// What lies on the table rises with it; what a world file gives only two numbers stands on it anyway.
Status change_world(YAML::Node world, const Condition& condition, const fs::path& folder) {
  world["light"]["brightness"] = world["light"]["brightness"].as<double>(1.0) * condition.light;
  YAML::Node top = world["table"]["top_center_m"];
  if (!top || top.size() != 3) {
    return Error{ErrorCode::kInvalidArgument, "the world has no table: top_center_m to raise"};
  }
  top[2] = top[2].as<double>() + condition.table_raise_m;
  for (YAML::Node object : world["objects"]) {
    YAML::Node p = object["position_m"];
    if (p && p.size() == 3) p[2] = p[2].as<double>() + condition.table_raise_m;
  }
  return write(folder / "world.yaml", world);
}

// Its files are seen from the folder of the original.
Status change_robot(YAML::Node robot, const Condition& condition, const fs::path& original,
                    const fs::path& folder) {
  const auto seen_from_here = [&](YAML::Node keys) {
    keys["urdf"] = (original.parent_path() / keys["urdf"].as<std::string>("icub.urdf")).string();
  };
  for (const char* section : {"simulation", "body"}) {
    if (robot[section]) seen_from_here(robot[section]);
  }
  for (YAML::Node device : robot["devices"]) {
    const auto kind = device["kind"].as<std::string>("");
    if (kind.starts_with("task/")) seen_from_here(device["parameters"]);
    if (kind == "sim/eye") device["parameters"]["noise_levels"] = condition.camera_noise;
  }
  return write(folder / "robot.yaml", robot);
}

}  // namespace

Result<Condition> condition_of(const std::string& name) {
  std::vector<std::string> names;
  for (const Condition& condition : known()) {
    if (condition.name == name) return condition;
    names.push_back(condition.name);
  }
  return Error{ErrorCode::kInvalidArgument,
               fmt::format("there is no condition '{}'; there are {}", name, fmt::join(names, ", "))};
}

std::string described(const Condition& condition) {
  return fmt::format("light {}, table {:.0f} cm higher, camera noise of {} levels", condition.light,
                     100.0 * condition.table_raise_m, condition.camera_noise);
}

Result<std::vector<std::string>> make_condition(const Places& places, const Condition& condition,
                                                const std::string& world, const std::string& robot,
                                                const std::filesystem::path& folder) {
  const auto world_file = find_config(places, "worlds", "world", world);
  if (!world_file) return world_file.error();
  const auto robot_file = find_config(places, "robots", "robot", robot);
  if (!robot_file) return robot_file.error();
  std::vector<std::string> words = {"--world", world, "--robot", robot};
  const fs::path own = folder / condition.name;
  std::error_code failure;
  fs::create_directories(own, failure);
  if (failure) return Error{ErrorCode::kFailed, own.string() + ": " + failure.message()};
  try {
    if (condition.light != 1.0 || condition.table_raise_m != 0.0) {
      const YAML::Node original = YAML::LoadFile(world_file->string());
      if (const Status made = change_world(original, condition, own); !made) return made.error();
      words[1] = (own / "world.yaml").string();
      // the judge measures how far a thing is off the table, which change_world() raised
      const auto z_m = original["table"]["top_center_m"][2].as<double>();
      words.emplace_back("--set");
      words.push_back(fmt::format("judge.table_z_m={}", z_m));
    }
    if (condition.camera_noise != 0.0) {
      if (const Status made =
              change_robot(YAML::LoadFile(robot_file->string()), condition, fs::absolute(*robot_file), own);
          !made) {
        return made.error();
      }
      words[3] = (own / "robot.yaml").string();
    }
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{} or {}: {}", world_file->string(), robot_file->string(), e.what())};
  }
  return words;
}

}  // namespace nido
