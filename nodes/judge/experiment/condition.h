#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/launcher/paths.h"

namespace nido {

// What the experimenter makes of room and eyes. Nobody tells the robot.
struct Condition {
  std::string name = "normal";  // of metrics and folders
  double light = 1.0;           // of the room, 1 is normal
  double table_raise_m = 0.0;   // table and what stands on it
  double camera_noise = 0.0;  // standard deviation, levels of 255, every channel of every pixel of both eyes
};

// normal, dark, bright, raised, noisy, degraded; kInvalidArgument names them.
Result<Condition> condition_of(const std::string& name);

// "light 0.5, table 3 cm higher"
std::string described(const Condition& condition);

// Writes a world and a robot file like the given ones, but for the condition, into `folder`, if they differ;
// what nido launch is to be told.
Result<std::vector<std::string>> make_condition(const Places& places, const Condition& condition,
                                                const std::string& world, const std::string& robot,
                                                const std::filesystem::path& folder);

}  // namespace nido
