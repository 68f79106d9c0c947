#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "nido/interfaces/audio.h"
#include "nido/interfaces/camera.h"
#include "nido/interfaces/clock.h"
#include "nido/interfaces/control_board.h"
#include "nido/interfaces/depth_camera.h"
#include "nido/interfaces/device.h"
#include "nido/interfaces/inertial.h"
#include "nido/interfaces/task_control.h"
#include "nido/interfaces/touch.h"
#include "nido/interfaces/world.h"
#include "nido/launcher/schema.h"

namespace nido::sim {
class SimulatedRobot;
}
namespace nido::yarp {
class Network;
}

namespace nido {

// What the robot hears; docs/robot.md.
struct AudioSettings {
  std::string source = "silence";  // "wav", "synthesis", "microphone", "silence"
  std::string file;                // of source wav
  std::string text;                // of source synthesis
  std::string voice = "en-us";
  double start_s = 1.0;  // robot's time at which the sound begins
};

// What one run chooses, beyond the robot file.
struct RunSettings {
  std::filesystem::path world_file;  // empty: a floor and nothing else
  std::string target;                // object that a random world must have; empty: the seed chooses
  std::uint64_t seed = 1;
  std::string base;  // what holds a simulated root; empty: as the robot file says
  AudioSettings audio;
  bool goes_on = false;        // from a snapshot: nothing is at its beginning
  std::filesystem::path said;  // sound file for what the robot says; empty: none
};

// What devices are made with.
struct DeviceContext {
  const IClock& clock;         // outlives the devices
  std::filesystem::path file;  // the robot file: paths in it are seen from its folder
  RunSettings run;
  YAML::Node simulation;  // of the robot file
  // The simulation that all devices of the family sim share, made by the first of them.
  std::shared_ptr<sim::SimulatedRobot> simulated;
  // The YARP network that all devices of the family yarp share, made by the first of them.
  std::shared_ptr<yarp::Network> yarp_network;
  // A control board that was made before, with its limits; null for any other name.
  std::function<IControlBoard*(const std::string& name)> board{};
};

using AnyDevice =
    std::variant<std::unique_ptr<IControlBoard>, std::unique_ptr<ICamera>, std::unique_ptr<ITouch>,
                 std::unique_ptr<IAudioGrabberSound>, std::unique_ptr<IWorld>, std::unique_ptr<IForceTorque>,
                 std::unique_ptr<IInertial>, std::unique_ptr<IAudioRender>,
                 std::unique_ptr<ICartesianControl>, std::unique_ptr<IGazeControl>,
                 std::unique_ptr<IDepthCamera>>;

struct MadeDevice {
  AnyDevice device;
  ISteppable* steppable = nullptr;  // the device itself, when it has to be stepped
  ISteppable* commander = nullptr;  // the device itself, when it commands boards: stepped before their limits
  bool is_under_limits = false;     // a board made of boards, which are under their limits already
};

// One kind of device that a robot file can name: FAMILY/WHAT.
struct DeviceKind {
  std::string name;
  Schema parameters;
  std::function<Result<MadeDevice>(const YAML::Node& parameters, DeviceContext& context)> make;
};

// All kinds of all families. To add a family, write its function and name it in device_registry.cpp.
const std::vector<DeviceKind>& device_kinds();
std::vector<DeviceKind> simulated_family();
std::vector<DeviceKind> fake_family();
std::vector<DeviceKind> audio_family();
std::vector<DeviceKind> yarp_family();
std::vector<DeviceKind> task_family();
std::vector<DeviceKind> joined_family();

// Makes a device of a kind. Parameters are checked; failures name the file and line.
Result<MadeDevice> make_device(const std::string& kind, const YAML::Node& parameters, DeviceContext& context);

}  // namespace nido
