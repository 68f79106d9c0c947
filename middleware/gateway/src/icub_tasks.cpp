#include "nido/gateway/icub_tasks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace nido::gateway {
namespace {

using yarp::Bottle;
using yarp::Value;

constexpr double kDegree_rad = std::numbers::pi / 180.0;
constexpr std::size_t kMostContexts = 1000;

bool is(const Bottle& words, std::size_t at, std::string_view letters) {
  // a string of a client that spells words out, or its first four letters as a vocab
  return at < words.size() && words[at].is_text() &&
         std::string_view(words[at].text).substr(0, 4) == letters.substr(0, 4);
}

Bottle ack(Bottle more = {}) {
  more.insert(more.begin(), Value::word("ack"));
  return more;
}
Bottle nack(const std::string& reason) { return {Value::word("nack"), Value::string(reason)}; }
Bottle outcome(const Status& status) { return status ? ack() : nack(status.error().message); }
Value truth(bool yes) { return Value::word(yes ? "true" : "fals"); }

template <class Numbers>
Value list_of(const Numbers& numbers) {
  Bottle list;
  for (const double number : numbers) list.push_back(Value::of(number));
  return Value::list(std::move(list));
}

// The numbers of a list of words from one on; nothing when one is none or not finite.
std::optional<std::vector<double>> numbers_of(std::span<const Value> words) {
  std::vector<double> numbers;
  for (const Value& word : words) {
    if (!word.is_number() || !std::isfinite(word.as_number())) return std::nullopt;
    numbers.push_back(word.as_number());
  }
  return numbers;
}
std::optional<std::vector<double>> numbers_in(const Bottle& words, std::size_t at) {
  if (at >= words.size() || !words[at].is_list()) return std::nullopt;
  return numbers_of(words[at].items);
}

// x y z, axis, angle
std::vector<double> pose_numbers(const Eigen::Isometry3d& X) {
  const Eigen::AngleAxisd turn(X.linear());
  return {X.translation().x(), X.translation().y(), X.translation().z(), turn.axis().x(),
          turn.axis().y(),     turn.axis().z(),     turn.angle()};
}

Result<CartesianGoal> goal_of(const std::optional<std::vector<double>>& numbers, bool with_orientation) {
  if (!numbers || numbers->size() < (with_orientation ? 7U : 3U)) {
    return Error{ErrorCode::kInvalidArgument, "a place is three numbers, a pose four more: axis and angle"};
  }
  const std::vector<double>& n = *numbers;
  CartesianGoal goal;
  goal.with_orientation = with_orientation;
  goal.X_RootPalm.translation() = Eigen::Vector3d(n[0], n[1], n[2]);
  if (!with_orientation) return goal;
  const Eigen::Vector3d axis(n[3], n[4], n[5]);
  if (axis.norm() < 1e-6) return Error{ErrorCode::kInvalidArgument, "the axis of the turn has no length"};
  goal.X_RootPalm.linear() = Eigen::AngleAxisd(n[6], axis.normalized()).toRotationMatrix();
  return goal;
}

// nido's order of the torso is that of its board: yaw, roll, pitch
std::vector<double> in_chain_order(std::vector<double> joints) {
  if (joints.size() >= 3) std::swap(joints[0], joints[2]);
  return joints;
}

// Deletes contexts that are named in a list; the first one stays.
template <class Contexts>
void forget(Contexts& contexts, const Bottle& command) {
  const auto ids = numbers_in(command, 1);
  for (const double id : ids.value_or(std::vector<double>())) {
    if (id != 0) contexts.erase(static_cast<int>(std::clamp(id, -1.0, 2e9)));
  }
}

// The context that is named by a number.
template <class Contexts>
auto context_of(Contexts& contexts, const Bottle& command) {
  const bool named =
      command.size() > 1 && command[1].is_integer() && std::abs(command[1].integer) < 2'000'000'000;
  return named ? contexts.find(static_cast<int>(command[1].integer)) : contexts.end();
}

}  // namespace

// ---- the hand

Bottle CartesianWords::pose_vector(const CartesianState& state) {
  return yarp::vector_bottle(pose_numbers(state.X_RootPalm));
}

Bottle CartesianWords::reply(const Bottle& command) {
  if (is(command, 0, "get")) return get(command);
  if (is(command, 0, "set")) return set(command);
  if (is(command, 0, "go")) return go(command);
  if (is(command, 0, "ask")) return ask(command);
  if (is(command, 0, "stop")) return outcome(hand_.stop());
  if (is(command, 0, "stor")) {
    if (contexts_.size() >= kMostContexts) return nack("too many contexts are stored: delete some");
    contexts_[++last_context_] = settings_;
    return ack({Value::of(last_context_)});
  }
  if (is(command, 0, "rest")) {
    const auto found = context_of(contexts_, command);
    if (found == contexts_.end()) return nack("there is no such context");
    settings_ = found->second;
    return ack();
  }
  if (is(command, 0, "del")) {
    forget(contexts_, command);
    return ack();
  }
  if (is(command, 0, "tvel")) return nack("speeds of the hand are not taken: go to poses");
  if (is(command, 0, "even")) return nack("there are the events motion-onset and motion-done");
  return nack("get, set, go, ask, stop, stor, rest and del are understood");
}

Bottle CartesianWords::get(const Bottle& command) {
  if (is(command, 1, "mode")) return ack({Value::word(settings_.tracking ? "cont" : "shot")});
  if (is(command, 1, "refe")) return ack({truth(false)});
  if (is(command, 1, "prio"))
    return ack({Value::string(settings_.position_first ? "position" : "orientation")});
  if (is(command, 1, "time")) return ack({Value::of(settings_.time_s)});
  if (is(command, 1, "tol")) return ack({Value::of(settings_.tolerance_m)});
  if (is(command, 1, "ison")) return ack({truth(true)});
  if (is(command, 1, "tip")) return ack({list_of(std::vector<double>{0, 0, 0, 1, 0, 0, 0})});
  if (is(command, 1, "info")) {
    Bottle about = {Value::list({Value::string("part_name"), Value::string(part_)}),
                    Value::list({Value::string("server"), Value::string("nido")})};
    return ack({Value::list(std::move(about))});
  }
  const Result<CartesianState> state = hand_.state();
  if (!state) return nack(state.error().message);
  if (is(command, 1, "done")) return ack({truth(!state->moving)});
  CartesianGoal here;
  here.X_RootPalm = state->X_RootPalm;
  if (is(command, 1, "des")) return desired(goal_.value_or(here));
  const Result<CartesianPlan> plan = hand_.plan(here);
  if (!plan) return nack(plan.error().message);
  const auto axes = static_cast<std::int64_t>(plan->joints_rad.size());
  if (is(command, 1, "dof")) {
    return ack({list_of(std::vector<double>(plan->joints_rad.size(), 1.0))});
  }
  if (is(command, 1, "resp") || is(command, 1, "resw")) {
    return ack({list_of(std::vector<double>(plan->joints_rad.size(), 0.0))});
  }
  const bool has_axis =
      command.size() > 2 && command[2].is_integer() && command[2].integer >= 0 && command[2].integer < axes;
  if (is(command, 1, "pose")) {
    if (command.size() > 2 && (!has_axis || command[2].integer != axes - 1)) {
      return nack(fmt::format("poses are told of the last axis, {}, only", axes - 1));
    }
    const double time_s = static_cast<double>(state->stamp_ns) * 1e-9;
    return ack({list_of(pose_numbers(state->X_RootPalm)), Value::list({Value::of(0), Value::of(time_s)})});
  }
  if (is(command, 1, "lim") && has_axis) {
    const auto limits = limits_(static_cast<int>(command[2].integer));
    if (!limits) return nack(limits.error().message);
    return ack({Value::of(limits->first), Value::of(limits->second)});
  }
  return nack(
      "get mode, prio, time, tol, ison, done, pose, des, dof, resp, resw, lim AXIS, tip, info are "
      "understood");
}

Bottle CartesianWords::set(const Bottle& command) {
  const bool number = command.size() > 2 && command[2].is_number() && std::isfinite(command[2].as_number());
  if (is(command, 1, "mode") && (is(command, 2, "cont") || is(command, 2, "shot"))) {
    settings_.tracking = is(command, 2, "cont");
    return ack();
  }
  if (is(command, 1, "prio") && (is(command, 2, "position") || is(command, 2, "orientation"))) {
    settings_.position_first = is(command, 2, "position");
    return ack();
  }
  if (is(command, 1, "time") && number && command[2].as_number() > 0) {
    settings_.time_s = command[2].as_number();
    return ack();
  }
  if (is(command, 1, "tol") && number && command[2].as_number() > 0) {
    settings_.tolerance_m = command[2].as_number();
    return ack();
  }
  // joints are chosen and led by the robot: what holds is told, as the interface has it
  for (const char* what : {"dof", "resp", "resw"}) {
    if (is(command, 1, what)) return get({Value::word("get"), Value::word(what)});
  }
  if (is(command, 1, "tip")) {
    const auto tip = numbers_in(command, 2);
    const bool none =
        tip && std::all_of(tip->begin(), tip->begin() + std::min<std::ptrdiff_t>(3, std::ssize(*tip)),
                           [](double n) { return n == 0; });
    return none && std::abs(tip->back()) < 1e-9 ? ack()
                                                : nack("the palm is the tip: no other frame is attached");
  }
  return nack("set mode cont|shot, prio, time, tol, dof, resp and resw are understood");
}

Bottle CartesianWords::go(const Bottle& command) {
  if (command.size() < 4 || !command[2].is_number() || !(is(command, 1, "full") || is(command, 1, "xyz")))
    return nack("go full|xyz SECONDS (NUMBER ...) is expected");
  Result<CartesianGoal> goal = goal_of(numbers_in(command, 3), is(command, 1, "full"));
  if (!goal) return nack(goal.error().message);
  const double time_s = command[2].as_number();
  goal->duration_s = time_s > 0 ? time_s : settings_.time_s;
  const Status begun = hand_.go_to(*goal);
  if (begun) goal_ = *goal;
  return outcome(begun);
}

Bottle CartesianWords::ask(const Bottle& command) {
  std::optional<std::vector<double>> place;
  bool with_orientation = true;
  for (const Value& option : command) {
    if (!option.is_list()) continue;
    if (is(option.items, 0, "xd")) place = numbers_in(option.items, 1);
    if (is(option.items, 0, "pose")) with_orientation = !is(option.items, 1, "xyz");
  }
  const Result<CartesianGoal> goal = goal_of(place, with_orientation);
  return goal ? desired(*goal) : nack(goal.error().message);
}

// Where the hand and its joints would come to rest.
Bottle CartesianWords::desired(const CartesianGoal& goal) {
  const Result<CartesianPlan> plan = hand_.plan(goal);
  if (!plan) return nack(plan.error().message);
  std::vector<double> joints_deg;
  for (const double joint_rad : plan->joints_rad) joints_deg.push_back(joint_rad / kDegree_rad);
  return ack({Value::list({Value::word("x"), list_of(pose_numbers(goal.X_RootPalm))}),
              Value::list({Value::word("q"), list_of(in_chain_order(std::move(joints_deg)))})});
}

// ---- the gaze

Bottle GazeWords::fixation_vector(const GazeState& state) {
  const Eigen::Vector3d& p = state.p_RootFixation_m;
  return yarp::vector_bottle({p.x(), p.y(), p.z()});
}
Bottle GazeWords::angles_vector(const GazeState& state) {
  const Eigen::Vector3d deg = state.angles_rad / kDegree_rad;
  return yarp::vector_bottle({deg.x(), deg.y(), deg.z()});
}
Bottle GazeWords::joints_vector(const GazeState& state) {
  std::vector<double> joints_deg;
  for (const double joint_rad : state.torso_rad) joints_deg.push_back(joint_rad / kDegree_rad);
  joints_deg = in_chain_order(std::move(joints_deg));
  for (const double joint_rad : state.head_rad) joints_deg.push_back(joint_rad / kDegree_rad);
  return yarp::vector_bottle(joints_deg);
}

Status GazeWords::begun(Status status) {
  if (status) has_target_ = true;
  return status;
}

Status GazeWords::point(const Bottle& command) {
  const auto n = numbers_of(command);
  if (!n || n->size() != 3) return Error{ErrorCode::kInvalidArgument, "a point is three numbers, m"};
  return begun(gaze_.look_at({(*n)[0], (*n)[1], (*n)[2]}));
}

Status GazeWords::mono(const Bottle& command) {
  if (command.size() == 4 && (is(command, 0, "left") || is(command, 0, "right"))) {
    if (const auto n = numbers_of(std::span(command).subspan(1)))
      return begun(gaze_.look_at_pixel(is(command, 0, "left") ? 0 : 1, {(*n)[0], (*n)[1]}, (*n)[2]));
  }
  return Error{ErrorCode::kInvalidArgument, "left|right U V Z is expected, in pixels and m"};
}

Status GazeWords::stereo(const Bottle& command) {
  const auto n = numbers_of(command);
  if (!n || n->size() != 4) return Error{ErrorCode::kInvalidArgument, "UL VL UR VR is expected, in pixels"};
  return begun(gaze_.look_at_pixels({(*n)[0], (*n)[1]}, {(*n)[2], (*n)[3]}));
}

Status GazeWords::angles(const Bottle& command) {
  if (command.size() == 4 && (is(command, 0, "abs") || is(command, 0, "rel"))) {
    if (const auto n = numbers_of(std::span(command).subspan(1))) {
      return begun(gaze_.look_by_angles(is(command, 0, "rel"),
                                        Eigen::Vector3d((*n)[0], (*n)[1], (*n)[2]) * kDegree_rad));
    }
  }
  return Error{ErrorCode::kInvalidArgument, "abs|rel AZIMUTH ELEVATION VERGENCE is expected, in degrees"};
}

Status GazeWords::follow(const GazeState& state) {
  if (!has_target_ || tracking_ || state.moving) return {};
  has_target_ = false;
  return gaze_.stop();
}

Bottle GazeWords::reply(const Bottle& command) {
  if (is(command, 0, "get")) return get(command);
  if (is(command, 0, "set") && is(command, 1, "track") && command.size() > 2 && command[2].is_number()) {
    tracking_ = command[2].as_number() > 0;
    return ack();
  }
  if (is(command, 0, "look")) {
    // as newer clients have it: look 3D (X Y Z), mono (...), ster (...), ang (...)
    if (command.size() < 3 || !command[2].is_list()) return nack("look 3D|mono|ster|ang (...) is expected");
    if (is(command, 1, "3D")) return outcome(point(command[2].items));
    if (is(command, 1, "mono")) return outcome(mono(command[2].items));
    if (is(command, 1, "ster")) return outcome(stereo(command[2].items));
    if (is(command, 1, "ang")) return outcome(angles(command[2].items));
    return nack("look 3D|mono|ster|ang (...) is expected");
  }
  if (is(command, 0, "stop")) {
    has_target_ = false;
    return outcome(gaze_.stop());
  }
  if (is(command, 0, "stor")) {
    if (contexts_.size() >= kMostContexts) return nack("too many contexts are stored: delete some");
    contexts_[++last_context_] = tracking_;
    return ack({Value::of(last_context_)});
  }
  if (is(command, 0, "rest")) {
    const auto found = context_of(contexts_, command);
    if (found == contexts_.end()) return nack("there is no such context");
    tracking_ = found->second;
    return ack();
  }
  if (is(command, 0, "del")) {
    forget(contexts_, command);
    return ack();
  }
  // nothing is ever bound
  if (is(command, 0, "clear")) return ack();
  if (is(command, 0, "bind")) return nack("the joints of the neck are not bound: limit them on their board");
  return nack("get, set track, look, stop, stor, rest, del and clear are understood");
}

Bottle GazeWords::get(const Bottle& command) {
  if (is(command, 1, "track")) return ack({Value::of(tracking_ ? 1 : 0)});
  if (is(command, 1, "info")) {
    return ack({Value::list({Value::list({Value::string("server"), Value::string("nido")})})});
  }
  const Result<GazeState> state = gaze_.state();
  if (!state) return nack(state.error().message);
  if (is(command, 1, "done") || is(command, 1, "sdon")) return ack({Value::of(state->moving ? 0 : 1)});
  if (is(command, 1, "des")) return ack({Value::list(joints_vector(*state))});
  if (is(command, 1, "pose") && (is(command, 2, "left") || is(command, 2, "right"))) {
    const Eigen::Isometry3d& X = state->X_RootEyes[is(command, 2, "left") ? 0 : 1];
    const double time_s = static_cast<double>(state->stamp_ns) * 1e-9;
    return ack({list_of(pose_numbers(X)), Value::list({Value::of(0), Value::of(time_s)})});
  }
  return nack("get track, done, des, pose left|right and info are understood");
}

}  // namespace nido::gateway
