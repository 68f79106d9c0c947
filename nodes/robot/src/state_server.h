#pragma once

#include <memory>
#include <string>

#include "nido/middleware/node.h"
#include "nido/simulator/devices/simulated_robot.h"
#include "nido/wrappers/server.h"

namespace nido {

// `PORT:o` (std_msgs/String, profile event): the hash of the simulation's complete state after every control
// period, as `world hash` says it, only while somebody is connected. To compare runs. Node and robot must
// outlive the server.
Result<std::unique_ptr<IServer>> serve_state_hash(Node& node, const std::string& port,
                                                  const sim::SimulatedRobot& robot);

}  // namespace nido
