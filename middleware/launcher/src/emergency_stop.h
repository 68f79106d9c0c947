#pragma once

#include <string>
#include <vector>

#include "nido/middleware/directory.h"
#include "nido/middleware/node.h"

namespace nido {

// What came of asking one robot to stop.
struct StopAnswer {
  std::string robot;  // name of its process
  std::string error;  // why it did not answer; empty: it stopped
};

// Asks every robot that is there to stop: every process with a port `…/estop` (docs/safety.md). Waits for
// each answer, at most 1 s of wall time. `reason` is what the robots will say of it.
std::vector<StopAnswer> stop_robots(Node& node, Directory& directory, const std::string& reason);

}  // namespace nido
