#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "src/safety_section.h"

namespace nido {

// One device of a robot file. The kind's own parameters are checked when the device is made.
struct DeviceEntry {
  std::string name;  // unique in the file
  std::string kind;  // "sim/control_board"; docs/robot.md lists them
  YAML::Node parameters;
};

// A device that is put on the network.
struct ServerEntry {
  std::string device;  // name of a device of the file
  std::string port;  // stem of its ports: "left_arm" becomes "/icubSim/left_arm"; with a leading '/' it stays
  double rate_hz = 100;    // of what it publishes
  std::string frame;       // frame_id of its messages
  double latency_s = 0;    // cameras: from taking a picture to its publication
  bool on_demand = false;  // only while somebody is connected: for what costs much and is looked at seldom
};

// The body, for /tf.
struct BodyEntry {
  std::string urdf;  // seen from the robot file's folder; empty: no /tf
  double rate_hz = 10;
};

// A robot file, checked, with every default filled in.
struct RobotFile {
  std::filesystem::path path;
  std::string robot;            // first part of all port names: "icubSim"
  bool simulated_time = false;  // the robot process makes /clock; else the computer's clock
  double period_s = 0.01;       // control period
  bool window = false;          // the simulation is shown on this computer's display
  YAML::Node simulation;        // parameters of the simulator; empty map unless a device needs one
  BodyEntry body;
  SafetyEntry safety;
  std::vector<DeviceEntry> devices;
  std::vector<ServerEntry> servers;
};

// Reads and checks a robot file. The first wrong key or value is refused with file, line, what was found and
// what is allowed.
Result<RobotFile> load_robot_file(const std::filesystem::path& path);

}  // namespace nido
