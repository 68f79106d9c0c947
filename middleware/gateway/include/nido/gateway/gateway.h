#pragma once

#include <memory>
#include <string>

#include "nido/interfaces/result.h"
#include "nido/middleware/node.h"
#include "nido/yarp/event_loop.h"
#include "nido/yarp/port_host.h"

namespace nido::gateway {

struct GatewayOptions {
  yarp::PortHostOptions ports;
  // "auto": serve names, or register if a name server has the number already
  bool register_if_taken = true;
  // stem of the ports of iCub's gaze controller, which nido's gaze stands behind; empty: a real one will have
  // them
  std::string gaze_stem = "/iKinGazeCtrl";
  // the same of the controllers of its hands, behind the robot's name: /icubSim/cartesianController/right_arm
  std::string cartesian_stem = "cartesianController";
};

// Shows every port of a nido system to YARP, as it comes and goes: outputs can be read, inputs written,
// services asked, connections made from either side. `node` and `loop` must outlive it; it works as long as
// the loop turns. For the loop's thread.
class Gateway {
 public:
  static Result<std::unique_ptr<Gateway>> open(Node& node, yarp::EventLoop& loop, GatewayOptions options);
  virtual ~Gateway() = default;
  [[nodiscard]] virtual yarp::PortHost& ports() = 0;
};

// "host", "names_port", "names" (auto, serve, register), "first_port", "dialect" (3 or 4), "connections",
// "secret_file", "gaze_stem", "cartesian_stem".
Result<GatewayOptions> gateway_options(Node& node);

}  // namespace nido::gateway
