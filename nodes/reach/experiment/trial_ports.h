#pragma once

#include <memory>

#include "nido/middleware/node.h"
#include "nido/middleware/typed_port.h"
#include "nido/msgs/types.h"

namespace nido::reach {

// What the trials of reaching hear and say: what the eyes see, how the reach is getting on; where to look,
// what to reach for, how it ended. One thread.
struct TrialPorts {
  std::unique_ptr<Input<msgs::Percepts>> objects;
  std::unique_ptr<Input<msgs::ActionStatus>> status;
  std::unique_ptr<Output<msgs::GazeGoal>> gaze;
  std::unique_ptr<Output<msgs::ActionGoal>> goal;
  std::unique_ptr<Output<msgs::StageEvent>> outcome;

  // Opens them all under /trials.
  Status open(Node& node);
};

}  // namespace nido::reach
