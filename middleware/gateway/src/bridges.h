#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
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

// The ports of iCub's own controller before a service that is a hand or the gaze (docs/task_control.md); null
// for any other. gaze_stem: of the gaze's ports; empty: none.
Result<std::unique_ptr<Bridge>> bridge_task(BridgeContext& context, const std::string& service,
                                            const std::string& gaze_stem);

// What a camera tells of itself in camera_info:o, for those who ask at CAMERA/rpc.
Result<std::unique_ptr<Bridge>> bridge_camera(BridgeContext& context, const PortDescription& port);

// Name of the gateway's own port at the other end of `name`.
[[nodiscard]] std::string own_name(const Node& node, const std::string& name, const std::string& end);

}  // namespace nido::gateway
