#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
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

// Of a motion: what clients are told, in the words of events:o.
class MotionEvents {
 public:
  // `words`: regi|unre|list ongoing [SHARE], from `at` on; nothing when it is none of these.
  std::optional<yarp::Bottle> reply(const yarp::Bottle& words, std::size_t at);
  // What is to be told now.
  [[nodiscard]] std::vector<yarp::Bottle> follow(bool moving, double progress, std::int64_t stamp_ns);

 private:
  std::set<double> shares_;  // of a motion, that are told when they are over
  bool was_moving_ = false;
  double was_at_ = 1;
};

// All that a client can set, kept under numbers: stor, rest, del. Not thread-safe.
template <class Settings>
class Contexts {
 public:
  using Now = std::function<Result<Settings>()>;
  using Restore = std::function<Status(const Settings&)>;
  // Number 0 is what holds before the first order.
  Status begin(const Now& now) {
    if (!kept_.empty()) return {};
    const Result<int> first = store(now);
    return first ? Status() : Status(first.error());
  }
  // Nothing when the command is none of the three.
  std::optional<yarp::Bottle> reply(const yarp::Bottle& command, const Now& now, const Restore& restore);

 private:
  Result<int> store(const Now& now);
  std::map<int, Settings> kept_;
  int next_ = 0;
};

// A hand.
class CartesianWords {
 public:
  CartesianWords(ICartesianControl& hand, const std::string& part)
      : hand_(hand), type_(part.substr(0, part.find('_'))) {}

  // What came to PART/rpc:i, or to PART/command:i, where nobody hears the answer.
  yarp::Bottle reply(const yarp::Bottle& command);
  // A speed holds until another order, as clients are used to. The device's own holds kTaskSpeedHolds_s: call
  // this more often with each new state as long as who gave the speed is there, and let_go_of_speed() when
  // not.
  Status follow(const CartesianState& state);
  void let_go_of_speed() { speed_.reset(); }
  [[nodiscard]] bool keeps_speed() const { return speed_.has_value(); }
  // What PART/state:o says: x y z, axis, angle.
  [[nodiscard]] static yarp::Bottle pose_vector(const CartesianState& state);
  [[nodiscard]] MotionEvents& events() { return events_; }

 private:
  // What the device knows nothing of.
  struct Kept {
    bool tracking = false;
    bool position_first = true;
    double time_s = 2.0;
    double tolerance_m = 0.001;
    std::vector<double> rest_deg = std::vector<double>(10);  // in the order of the chain
    std::vector<double> rest_weights = std::vector<double>(10);
  };
  struct Context {
    Kept kept;
    CartesianSettings settings;
  };
  Result<Context> context() const;
  yarp::Bottle get(const yarp::Bottle& command);
  yarp::Bottle set(const yarp::Bottle& command);
  yarp::Bottle go(const yarp::Bottle& command);
  yarp::Bottle go_on(const yarp::Bottle& command);
  yarp::Bottle ask(const yarp::Bottle& command);
  yarp::Bottle desired(const CartesianGoal& goal);
  // The device's settings, those of `kept` among them.
  Status apply(CartesianSettings settings, const Kept& kept);

  ICartesianControl& hand_;
  const std::string type_;  // "left", "right"
  Kept kept_;
  Contexts<Context> contexts_;
  std::optional<CartesianGoal> goal_;  // the last one
  // that is held
  struct Speed {
    Eigen::Vector3d v_m_s;
    Eigen::Vector3d w_rad_s;
    std::uint32_t motion;  // the number of its motion
  };
  Status hold(const Eigen::Vector3d& v_m_s, const Eigen::Vector3d& w_rad_s);
  std::optional<Speed> speed_;
  MotionEvents events_;
};

// The gaze.
class GazeWords {
 public:
  explicit GazeWords(IGazeControl& gaze) : gaze_(gaze) {}

  // What came to the port rpc.
  yarp::Bottle reply(const yarp::Bottle& command);
  // What came to xd:i ("3D"), mono:i ("mono"), stereo:i ("ster") and angles:i ("ang").
  Status look(const std::string& kind, const yarp::Bottle& place);
  // Without tracking the point is let go when it is reached. Call it with each new state.
  Status follow(const GazeState& state);
  [[nodiscard]] bool has_target() const { return has_target_; }
  [[nodiscard]] MotionEvents& events() { return events_; }
  // What x:o, angles:o and q:o say.
  [[nodiscard]] static yarp::Bottle fixation_vector(const GazeState& state);
  [[nodiscard]] static yarp::Bottle angles_vector(const GazeState& state);
  [[nodiscard]] static yarp::Bottle joints_vector(const GazeState& state);

 private:
  // What the device knows nothing of.
  struct Kept {
    bool tracking = false;
    bool stabilizing = false;         // without a target the eyes keep in sight what they see
    GazeSettings::Saccades saccades;  // as they are or would be
    double tolerance = 0;             // means nothing to this robot
  };
  struct Context {
    Kept kept;
    GazeSettings settings;
  };
  Result<Context> context() const;
  Status restore(const Context& context);
  // Whether the gaze is held when there is no target.
  Status hold(bool stabilizing);
  yarp::Bottle get(const yarp::Bottle& command);
  yarp::Bottle set(const yarp::Bottle& command);
  // bind, clear
  yarp::Bottle bind(const yarp::Bottle& command);
  yarp::Bottle place_reply(const yarp::Bottle& command);
  Result<Eigen::Vector3d> place_of(const std::string& kind, const yarp::Bottle& place);
  Result<GazeBody> body();

  IGazeControl& gaze_;
  std::optional<GazeBody> body_;
  Kept kept_;
  Contexts<Context> contexts_;
  bool has_target_ = false;
  MotionEvents events_;
};

}  // namespace nido::gateway
