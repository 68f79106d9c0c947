#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "limits/limited_control_board.h"
#include "nido/interfaces/result.h"

namespace nido {

// A moment of a simulated robot's life, from which another process goes on: its time, the simulation, and
// what the limits remember of what was commanded.
struct RobotSnapshot {
  std::int64_t time_ns = 0;
  std::string simulation;                                     // sim::Simulation::snapshot()
  std::map<std::string, LimitedControlBoard::Memory> boards;  // by device
};

// The file appears whole or not at all. kFailed with the reason when it cannot be written.
Status write_robot_snapshot(const RobotSnapshot& snapshot, const std::filesystem::path& path);
// kNotFound, kInvalidArgument: no such file, or none that write_robot_snapshot() wrote.
Result<RobotSnapshot> read_robot_snapshot(const std::filesystem::path& path);

}  // namespace nido
