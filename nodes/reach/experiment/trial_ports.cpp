#include "trial_ports.h"

#include <utility>

namespace nido::reach {

Status TrialPorts::open(Node& node) {
  const auto keep = [](auto opened, auto& port) -> Status {
    if (!opened) return opened.error();
    port = std::move(*opened);
    return {};
  };
  if (Status done = keep(node.open_input<msgs::Percepts>("/trials/objects:i", Profile::kState), objects);
      !done)
    return done;
  if (Status done = keep(node.open_input<msgs::ActionStatus>("/trials/status:i", Profile::kEvent), status);
      !done)
    return done;
  if (Status done = keep(node.open_output<msgs::GazeGoal>("/trials/gaze:o", Profile::kEvent), gaze); !done)
    return done;
  if (Status done = keep(node.open_output<msgs::ActionGoal>("/trials/goal:o", Profile::kEvent), goal); !done)
    return done;
  return keep(node.open_output<msgs::StageEvent>("/trials/outcome:o", Profile::kEvent), outcome);
}

}  // namespace nido::reach
