#include "emergency_stop.h"

namespace nido {
namespace {
constexpr const char* kEstop = "/estop";  // last name of the port that stops a robot
constexpr double kPatience_s = 1.0;
}  // namespace

std::vector<StopAnswer> stop_robots(Node& node, Directory& directory, const std::string& reason) {
  std::vector<StopAnswer> answers;
  for (const auto& process : directory.nodes()) {
    for (const auto& port : process.ports) {
      if (port.direction != "service" || !port.name.ends_with(kEstop)) continue;
      const auto answer = node.call(port.name, reason, kPatience_s);
      answers.push_back({process.name, answer ? "" : answer.error().message});
    }
  }
  return answers;
}

}  // namespace nido
