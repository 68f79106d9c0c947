#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "nido/gateway/conversions.h"
#include "nido/middleware/directory.h"
#include "nido/middleware/node.h"
#include "nido/middleware/port_name.h"
#include "worker.h"

namespace nido::gateway {

// What bridges are made with; all of it outlives them.
struct BridgeContext {
  Node& node;
  Directory& directory;
  yarp::EventLoop& loop;
  yarp::PortHost& ports;
  Workers& workers;
};

// One port of nido, as long as it is there. Opens its YARP ports when made, closes them when destroyed.
class Bridge {
 public:
  virtual ~Bridge() = default;
};

// An output: taken from only while somebody reads.
Result<std::unique_ptr<Bridge>> bridge_output(BridgeContext& context, const PortDescription& port);
// An input: its nido output is opened with the first message.
Result<std::unique_ptr<Bridge>> bridge_input(BridgeContext& context, const PortDescription& port);
// A text service.
Result<std::unique_ptr<Bridge>> bridge_service(BridgeContext& context, const std::string& name);

// First parts of the names of iCub's own controllers; empty: none.
struct TaskStems {
  std::string gaze;       // "/iKinGazeCtrl"
  std::string cartesian;  // "cartesianController", behind the robot's name
};
// The ports of iCub's own controller before a service that is a hand or the gaze (docs/task_control.md); null
// for any other.
Result<std::unique_ptr<Bridge>> bridge_task(BridgeContext& context, const std::string& service,
                                            const TaskStems& stems);

// What a camera tells of itself in camera_info:o, for those who ask at CAMERA/rpc.
Result<std::unique_ptr<Bridge>> bridge_camera(BridgeContext& context, const PortDescription& port);

// An inertial sensor as YARP's clients of many sensors know it, multipleanalogsensorsclient: under
// /ROBOT/head/inertials measures:o, and rpc:o, where they ask which sensors there are. Each is a list for
// each of 12 kinds of sensor.
inline constexpr std::string_view kInertialOutput = "/inertial:o";
inline constexpr std::size_t kSensorKinds = 12;
inline constexpr std::size_t kGyroscopes = 0;
inline constexpr std::size_t kAccelerometers = 1;
inline constexpr std::size_t kOrientations = 3;
[[nodiscard]] inline std::string many_inertials(std::string_view output) {
  return std::string(output.substr(0, output.size() - kInertialOutput.size())) + "/head/inertials";
}
Result<std::unique_ptr<Bridge>> bridge_inertial(BridgeContext& context, const PortDescription& port);

// Name of the gateway's own port at the other end of `name`.
[[nodiscard]] std::string own_name(const Node& node, const std::string& name, const std::string& end);

}  // namespace nido::gateway
