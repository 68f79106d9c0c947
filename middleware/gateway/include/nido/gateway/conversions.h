#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "nido/cli/any_type.h"
#include "nido/interfaces/control_board.h"
#include "nido/interfaces/result.h"
#include "nido/yarp/bottle.h"
#include "nido/yarp/port_host.h"

namespace nido::gateway {

// How messages of nido look to YARP, and the other way. docs/yarp.md tells each form.

// What an output gives under one of its YARP names.
struct View {
  std::string name;  // "/icubSim/left_arm/state:o"
  std::string about;
  // The robot's time of the message, s.
  std::function<double(const void* message)> time_s;
  std::function<yarp::Content(const void* message)> content;
  bool wants_modes = false;  // stateExt:o: tells modes too, which are asked for by text
};

// Modes of a part's joints, as they were told last. Thread-safe.
class Modes {
 public:
  void set(std::vector<ControlMode> modes) {
    const std::lock_guard lock(mutex_);
    modes_ = std::move(modes);
  }
  [[nodiscard]] std::vector<ControlMode> get() const {
    const std::lock_guard lock(mutex_);
    return modes_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<ControlMode> modes_;
};

// All names under which YARP sees an output of nido, by its type and place: the nido name first.
std::vector<View> views_of(const std::string& output, const AnyType& type,
                           const std::shared_ptr<const Modes>& modes);

// What a YARP message to an input of nido means. `message` is an empty one of the type. kInvalidArgument says
// what was found and what is expected.
Status take_into(const AnyType& type, const yarp::Incoming& incoming, std::int64_t now_ns, void* message);

// The streaming commands of YARP's control boards: ((dpo 3) (45.0)), ((vmog 2 (0 1)) (10.0 -10.0)), ...
struct StreamCommand {
  ControlMode mode = ControlMode::kDirect;
  std::vector<int> joints;
  std::vector<double> values;  // SI
};
Result<StreamCommand> parse_stream_command(const yarp::Bottle& bottle);

// Any message, as pairs of name and value, and back.
yarp::Bottle bottle_of(const Json& value);
Result<Json> json_of(const yarp::Bottle& bottle, const Json& example);

}  // namespace nido::gateway
