#pragma once

#include <memory>
#include <optional>
#include <string>

#include "nido/middleware/node.h"

namespace nido {

// Where the owner of simulated time waits before each tick, and where others pause, step and pace it: the
// service /clock/rpc:i, which `nido clock` asks.
//
//     get            [ok] time_s=12.34 state=running rate=max
//     pause          no tick begins any more; what is asked of services is answered as before
//     run            goes on
//     step [N]       makes N ticks (1), then pauses; answered when they are made
//     rate R|max     simulated seconds in a second of wall time, > 0
//
// All but `step` are answered at once. A pause changes nothing in simulated time: a run in lockstep stays
// repeatable.
class ClockControl {
 public:
  // rate: see Pacer. kTaken if another node owns the clock already.
  static Result<std::unique_ptr<ClockControl>> open(Node& node, std::optional<double> rate,
                                                    bool is_paused = false);
  virtual ~ClockControl() = default;

  // Returns when the tick after `now` may begin: when it is due, and nobody has paused. kInterrupted when the
  // node is asked to stop meanwhile. For the one thread that makes the ticks.
  virtual Status wait(Time now) = 0;
  // What the service answers. Thread-safe.
  virtual std::string command(const std::string& line) = 0;
};

}  // namespace nido
