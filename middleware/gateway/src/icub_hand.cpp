// A hand, as cartesiancontrollerclient asks it.
#include <fmt/format.h>

#include "contexts.h"
#include "icub_words.h"
#include "nido/gateway/icub_tasks.h"

namespace nido::gateway {
namespace {

using yarp::Bottle;
using yarp::Value;

constexpr std::size_t kJoints = 10;

// nido's order of the torso is that of its board: yaw, roll, pitch
std::size_t in_chain(std::size_t axis) { return axis < 3 ? 2 - axis : axis; }

template <class Numbers>
std::vector<double> in_chain_order_deg(const Numbers& joints_rad) {
  std::vector<double> joints_deg;
  for (std::size_t axis = 0; axis < joints_rad.size(); ++axis) {
    joints_deg.push_back(joints_rad[in_chain(axis)] / kDegree_rad);
  }
  return joints_deg;
}

Result<Eigen::Isometry3d> pose_of(const std::vector<double>& n) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Eigen::Vector3d(n[0], n[1], n[2]);
  const Eigen::Vector3d axis(n[3], n[4], n[5]);
  if (axis.norm() > 1e-6) {
    X.linear() = Eigen::AngleAxisd(n[6], axis.normalized()).toRotationMatrix();
  } else if (std::abs(n[6]) > 1e-9) {
    return Error{ErrorCode::kInvalidArgument, "the axis of the turn has no length"};
  }
  return X;
}

Result<CartesianGoal> goal_of(const std::optional<std::vector<double>>& numbers, bool with_orientation) {
  if (!numbers || numbers->size() < (with_orientation ? 7U : 3U)) {
    return Error{ErrorCode::kInvalidArgument, "a place is three numbers, a pose four more: axis and angle"};
  }
  CartesianGoal goal;
  goal.with_orientation = with_orientation;
  if (!with_orientation) {
    goal.X_RootPalm.translation() = Eigen::Vector3d((*numbers)[0], (*numbers)[1], (*numbers)[2]);
    return goal;
  }
  const Result<Eigen::Isometry3d> pose = pose_of(*numbers);
  if (!pose) return pose.error();
  if (Eigen::Vector3d((*numbers)[3], (*numbers)[4], (*numbers)[5]).isZero()) {
    return Error{ErrorCode::kInvalidArgument, "the axis of the turn has no length"};
  }
  goal.X_RootPalm = *pose;
  return goal;
}

}  // namespace

Bottle CartesianWords::pose_vector(const CartesianState& state) {
  return yarp::vector_bottle(pose_numbers(state.X_RootPalm));
}

Result<CartesianWords::Context> CartesianWords::context() const {
  const Result<CartesianSettings> settings = hand_.settings();
  if (!settings) return settings.error();
  return Context{kept_, *settings};
}

Status CartesianWords::apply(CartesianSettings settings, const Kept& kept) {
  for (std::size_t axis = 0; axis < settings.rest_rad.size() && axis < kJoints; ++axis) {
    const std::size_t joint = in_chain(axis);
    settings.rest_rad[joint] =
        kept.rest_weights[axis] > 0 ? std::optional(kept.rest_deg[axis] * kDegree_rad) : std::nullopt;
  }
  Status set = hand_.set_settings(settings);
  if (set) kept_ = kept;
  return set;
}

Bottle CartesianWords::reply(const Bottle& command) {
  const auto now = [this] { return context(); };
  if (const Status begun = contexts_.begin(now); !begun) return nack(begun.error().message);
  if (is(command, 0, "get")) return get(command);
  if (is(command, 0, "set")) return set(command);
  if (is(command, 0, "go")) return go(command);
  if (is(command, 0, "ask")) return ask(command);
  if (is(command, 0, "stop")) {
    speed_.reset();
    return outcome(hand_.stop());
  }
  if (is(command, 0, "tvel")) return go_on(command);
  if (auto told = contexts_.reply(
          command, now, [this](const Context& context) { return apply(context.settings, context.kept); })) {
    return *std::move(told);
  }
  if (is(command, 0, "even")) {
    return events_.reply(command, 1).value_or(nack("even regi|unre|list ogoi [0..1] is expected"));
  }
  return nack("get, set, go, tvel, ask, stop, stor, rest, del and even are understood");
}

Bottle CartesianWords::get(const Bottle& command) {
  if (is(command, 1, "mode")) return ack({Value::word(kept_.tracking ? "cont" : "shot")});
  if (is(command, 1, "refe")) return ack({truth(false)});
  if (is(command, 1, "prio")) return ack({Value::string(kept_.position_first ? "position" : "orientation")});
  if (is(command, 1, "time")) return ack({Value::of(kept_.time_s)});
  if (is(command, 1, "tol")) return ack({Value::of(kept_.tolerance_m)});
  if (is(command, 1, "ison")) return ack({truth(true)});
  if (is(command, 1, "resp")) return ack({list_of(kept_.rest_deg)});
  if (is(command, 1, "resw")) return ack({list_of(kept_.rest_weights)});
  if (is(command, 1, "twea")) return ack({Value::list()});
  if (is(command, 1, "info")) {
    return ack({Value::list(
        {property("server_version", Value::string("2.0")), property("arm_version", Value::string("1.0")),
         property("arm_type", Value::string(type_)), property("events", event_names())})});
  }
  if (is(command, 1, "dof") || is(command, 1, "lim") || is(command, 1, "tip")) {
    const Result<CartesianSettings> settings = hand_.settings();
    if (!settings) return nack(settings.error().message);
    if (is(command, 1, "tip")) return ack({list_of(pose_numbers(settings->X_PalmTip))});
    if (is(command, 1, "dof")) {
      Bottle moves;
      for (std::size_t axis = 0; axis < kJoints; ++axis) {
        moves.push_back(Value::of(settings->moves[in_chain(axis)] ? 1 : 0));
      }
      return ack({Value::list(std::move(moves))});
    }
    const auto axis = number_at(command, 2);
    if (!axis || *axis < 0 || *axis >= static_cast<double>(kJoints)) return nack("the axes are 0 to 9");
    const std::size_t joint = in_chain(static_cast<std::size_t>(*axis));
    return ack({Value::of(settings->lower_rad[joint] / kDegree_rad),
                Value::of(settings->upper_rad[joint] / kDegree_rad)});
  }
  const Result<CartesianState> state = hand_.state();
  if (!state) return nack(state.error().message);
  if (is(command, 1, "done")) return ack({truth(!state->moving)});
  if (is(command, 1, "qdot")) return ack({list_of(in_chain_order_deg(state->velocities_rad_s))});
  if (is(command, 1, "xdot")) {
    // speed, axis of the turn, its rate
    const Eigen::Vector3d& v = state->v_m_s;
    const Eigen::Vector3d axis = state->w_rad_s.normalized();
    return ack({list_of(
        std::vector<double>{v.x(), v.y(), v.z(), axis.x(), axis.y(), axis.z(), state->w_rad_s.norm()})});
  }
  if (is(command, 1, "des")) {
    CartesianGoal here;
    here.X_RootPalm = state->X_RootPalm;
    return desired(goal_.value_or(here));
  }
  if (is(command, 1, "pose")) {
    if (command.size() <= 2) return stamped_pose(state->X_RootPalm, state->stamp_ns);
    const auto axis = number_at(command, 2);
    const Result<Eigen::Isometry3d> X =
        hand_.X_RootLink(axis ? static_cast<int>(std::clamp(*axis, -1.0, 1e6)) : -1);
    return X ? stamped_pose(*X, state->stamp_ns) : nack(X.error().message);
  }
  return nack(
      "get mode, refe, prio, time, tol, ison, done, pose [AXIS], des, dof, resp, resw, lim AXIS, qdot, xdot, "
      "tip, twea, info are understood");
}

Bottle CartesianWords::set(const Bottle& command) {
  Kept kept = kept_;
  const auto number = number_at(command, 2);
  const auto numbers = numbers_in(command, 2);
  if (is(command, 1, "mode") && (is(command, 2, "cont") || is(command, 2, "shot"))) {
    kept_.tracking = is(command, 2, "cont");
    return ack();
  }
  if (is(command, 1, "refe")) {
    return is(command, 2, "fals") ? ack() : nack("what is told is what the encoders say");
  }
  if (is(command, 1, "prio") && (is(command, 2, "position") || is(command, 2, "orientation"))) {
    kept_.position_first = is(command, 2, "position");
    return ack();
  }
  if ((is(command, 1, "time") || is(command, 1, "tol")) && number && *number > 0) {
    (is(command, 1, "time") ? kept_.time_s : kept_.tolerance_m) = *number;
    return ack();
  }
  if (is(command, 1, "twea")) {
    return numbers && numbers->empty() ? ack() : nack("there is nothing to be tweaked");
  }
  Result<CartesianSettings> settings = hand_.settings();
  if (!settings) return nack(settings.error().message);
  const bool of_joints = numbers && !numbers->empty() && numbers->size() <= kJoints;
  for (const auto& [what, target] : {std::pair{"resp", &Kept::rest_deg}, {"resw", &Kept::rest_weights}}) {
    if (!is(command, 1, what) || !of_joints) continue;
    std::copy(numbers->begin(), numbers->end(), (kept.*target).begin());
    const Status set = apply(*settings, kept);
    return set ? ack({list_of(kept_.*target)}) : nack(set.error().message);
  }
  if (is(command, 1, "dof") && of_joints) {
    // other numbers leave a joint as it is
    for (std::size_t axis = 0; axis < numbers->size(); ++axis) {
      const double wanted = (*numbers)[axis];
      if (wanted == 0 || wanted == 1) settings->moves[in_chain(axis)] = wanted == 1;
    }
    const Status set = apply(*settings, kept);
    return set ? get({Value::word("get"), Value::word("dof")}) : nack(set.error().message);
  }
  if (is(command, 1, "lim") && number && *number >= 0 && *number < static_cast<double>(kJoints)) {
    const auto lower = number_at(command, 3);
    const auto upper = number_at(command, 4);
    if (!lower || !upper) return nack("set lim AXIS MIN MAX is expected, degrees");
    const std::size_t joint = in_chain(static_cast<std::size_t>(*number));
    settings->lower_rad[joint] = *lower * kDegree_rad;
    settings->upper_rad[joint] = *upper * kDegree_rad;
    return outcome(apply(*settings, kept));
  }
  if (is(command, 1, "tip") && numbers && numbers->size() == 7) {
    const Result<Eigen::Isometry3d> tip = pose_of(*numbers);
    if (!tip) return nack(tip.error().message);
    settings->X_PalmTip = *tip;
    return outcome(apply(*settings, kept));
  }
  return nack(
      "set mode cont|shot, prio position|orientation, time, tol, dof (...), resp (...), resw (...), lim AXIS "
      "MIN "
      "MAX and tip (X Y Z AXIS ANGLE) are understood");
}

Bottle CartesianWords::go(const Bottle& command) {
  if (command.size() < 4 || !number_at(command, 2) || !(is(command, 1, "full") || is(command, 1, "xyz"))) {
    return nack("go full|xyz SECONDS (NUMBER ...) is expected");
  }
  Result<CartesianGoal> goal = goal_of(numbers_in(command, 3), is(command, 1, "full"));
  if (!goal) return nack(goal.error().message);
  const double time_s = command[2].as_number();
  goal->duration_s = time_s > 0 ? time_s : kept_.time_s;
  const Status begun = hand_.go_to(*goal);
  if (begun) {
    goal_ = *goal;
    speed_.reset();
  }
  return outcome(begun);
}

Bottle CartesianWords::go_on(const Bottle& command) {
  const auto n = numbers_in(command, 1);
  if (!n || n->size() != 7) return nack("tvel (VX VY VZ AXIS RATE) is expected: three, three, one");
  const Eigen::Vector3d v_m_s((*n)[0], (*n)[1], (*n)[2]);
  const Eigen::Vector3d axis((*n)[3], (*n)[4], (*n)[5]);
  const Eigen::Vector3d w_rad_s =
      axis.isZero() ? Eigen::Vector3d::Zero() : Eigen::Vector3d((*n)[6] * axis.normalized());
  return outcome(hold(v_m_s, w_rad_s));
}

Status CartesianWords::hold(const Eigen::Vector3d& v_m_s, const Eigen::Vector3d& w_rad_s) {
  if (Status begun = hand_.go_on(v_m_s, w_rad_s, kTaskSpeedHolds_s); !begun) return begun;
  const Result<CartesianState> state = hand_.state();
  if (!state) return state.error();
  speed_ = {v_m_s, w_rad_s, state->motion};
  return {};
}

Status CartesianWords::follow(const CartesianState& state) {
  if (!speed_) return {};
  // ended by a joint's limit, or by somebody else's order
  const bool is_over = (!state.moving && state.progress < 1) || state.motion != speed_->motion;
  if (is_over) {
    speed_.reset();
    return {};
  }
  const Speed held = *speed_;
  Status told = hold(held.v_m_s, held.w_rad_s);
  if (!told) speed_.reset();
  return told;
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
  return ack({Value::list({Value::word("x"), list_of(pose_numbers(plan->X_RootPalm))}),
              Value::list({Value::word("q"), list_of(in_chain_order_deg(plan->joints_rad))})});
}

}  // namespace nido::gateway
