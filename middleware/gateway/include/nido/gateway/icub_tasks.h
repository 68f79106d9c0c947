#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/task_control.h"
#include "nido/yarp/bottle.h"

namespace nido::gateway {

// What clients of iCub's own controllers of hand and gaze say (cartesiancontrollerclient,
// gazecontrollerclient), carried out by nido's devices. Lengths in m, turns as axis and angle (rad), joints
// in degrees, the torso's in the order of the chain: pitch, roll, yaw. Answers are [ack] ..., or [nack]
// "reason" for what nido's devices do not do: docs/yarp.md has the list. Facts about the words: the iCub
// software's public sources. Not thread-safe.

// A hand.
class CartesianWords {
 public:
  // Limits of a joint of the chain, degrees: torso, then arm.
  using Limits = std::function<Result<std::pair<double, double>>(int axis)>;
  CartesianWords(ICartesianControl& hand, std::string part, Limits limits)
      : hand_(hand), part_(std::move(part)), limits_(std::move(limits)) {}

  // What came to PART/rpc:i, or to PART/command:i, where nobody hears the answer.
  yarp::Bottle reply(const yarp::Bottle& command);
  // What PART/state:o says: x y z, axis, angle.
  [[nodiscard]] static yarp::Bottle pose_vector(const CartesianState& state);

 private:
  struct Settings {
    bool tracking = false;
    bool position_first = true;
    double time_s = 2.0;
    double tolerance_m = 0.001;
  };
  yarp::Bottle get(const yarp::Bottle& command);
  yarp::Bottle set(const yarp::Bottle& command);
  yarp::Bottle go(const yarp::Bottle& command);
  yarp::Bottle ask(const yarp::Bottle& command);
  yarp::Bottle desired(const CartesianGoal& goal);

  ICartesianControl& hand_;
  const std::string part_;
  const Limits limits_;
  Settings settings_;
  std::map<int, Settings> contexts_ = {{0, {}}};
  int last_context_ = 0;
  std::optional<CartesianGoal> goal_;  // the last one
};

// The gaze.
class GazeWords {
 public:
  explicit GazeWords(IGazeControl& gaze) : gaze_(gaze) {}

  // What came to the port rpc.
  yarp::Bottle reply(const yarp::Bottle& command);
  // What came to xd:i, mono:i, stereo:i, angles:i.
  Status point(const yarp::Bottle& command);
  Status mono(const yarp::Bottle& command);
  Status stereo(const yarp::Bottle& command);
  Status angles(const yarp::Bottle& command);
  // Without tracking the point is let go when it is reached. Call it with each new state.
  Status follow(const GazeState& state);
  [[nodiscard]] bool has_target() const { return has_target_; }
  // What x:o, angles:o and q:o say.
  [[nodiscard]] static yarp::Bottle fixation_vector(const GazeState& state);
  [[nodiscard]] static yarp::Bottle angles_vector(const GazeState& state);
  [[nodiscard]] static yarp::Bottle joints_vector(const GazeState& state);

 private:
  yarp::Bottle get(const yarp::Bottle& command);
  Status begun(Status status);

  IGazeControl& gaze_;
  bool tracking_ = false;
  std::map<int, bool> contexts_ = {{0, false}};
  int last_context_ = 0;
  bool has_target_ = false;
};

}  // namespace nido::gateway
