#include "nido/reach/reach_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace nido::reach {
namespace {

constexpr double kHistory_s = 1.0;
constexpr double kStill_rad = 0.003;  // change of a joint in kStillOver_s that counts as rest
constexpr double kStillOver_s = 0.05;
constexpr int kSightingsOfALook = 4;
constexpr double kInView_s = 0.2;   // since the last sighting: no use to wait for more
constexpr double kAgree_m = 0.012;  // strange sightings that differ no more tell of the same change

// "a bit left" as the robot has it; root frame.
std::optional<Eigen::Vector3d> direction_Root(const std::string& word) {
  if (word == "left") return Eigen::Vector3d(0, -1, 0);
  if (word == "right") return Eigen::Vector3d(0, 1, 0);
  if (word == "up") return Eigen::Vector3d(0, 0, 1);
  if (word == "down") return Eigen::Vector3d(0, 0, -1);
  if (word == "forward") return Eigen::Vector3d(-1, 0, 0);
  if (word == "back") return Eigen::Vector3d(1, 0, 0);
  return std::nullopt;
}

std::string shape_of(const std::string& object) {
  const auto blank = object.find_last_of(' ');
  return blank == std::string::npos ? object : object.substr(blank + 1);
}

}  // namespace

ReachCore::ReachCore(MotionPlanner planner, ReachOptions options)
    : planner_(std::move(planner)), options_(std::move(options)) {
  p_PalmHeld_m_.z() *= planner_.chain().palm_z();
}

ReachOutput ReachCore::step(double now_s, const ReachInput& input) {
  note_.reset();
  corrected_ = false;
  if (input.objects) planner_.set_objects(*input.objects);
  watch_joints(now_s, input);
  if (input.hand) {
    hand_seen_at_s_ = now_s;
    take_sighting(*input.hand);
  }
  if (input.goal) {
    waiting_ = input.goal;
    waiting_since_s_ = now_s;
    stages_.clear();  // what was under way ends here; the arm holds its last target
    status_ = {input.goal->id, input.goal->action, ActionState::kRunning, "", 0.0};
  }
  if (waiting_ && !coast()) {
    if (measured_ && now_s - measured_at_s_ <= options_.encoders_missing_s) {
      const ReachGoal goal = *waiting_;
      waiting_.reset();
      begin(goal);
      stage_begun_ = false;
    } else if (now_s - waiting_since_s_ > 2.0) {
      waiting_.reset();
      finish(ActionState::kFailed,
             "the arm's and torso's encoders do not arrive at /reach/arm:i and /reach/torso:i");
    }
  }
  if (status_.state == ActionState::kRunning && !waiting_) {
    const std::optional<Joints> before = command_;
    run_stages(now_s);
    if (before && command_) coast_rad_ = *command_ - *before;
  } else if (!waiting_) {
    coast();
  }
  if (measured_ && present_goal_) status_.error_m = goal_error_m();
  return {command_, status_, note_, corrected_};
}

void ReachCore::follow_torso() {
  if (status_.state == ActionState::kRunning || waiting_ || !command_ || !measured_) return;
  command_->head<kTorsoJoints>() = measured_->head<kTorsoJoints>();
}

bool ReachCore::coast() {
  if (!command_ || coast_rad_.cwiseAbs().maxCoeff() < 1e-4) {
    coast_rad_.setZero();
    return false;
  }
  coast_rad_ *= 0.8;
  command_ = planner_.chain().clamped(*command_ + coast_rad_);
  return true;
}

void ReachCore::watch_joints(double now_s, const ReachInput& input) {
  if (input.measured_rad && input.measured_rad->allFinite()) {
    measured_ = input.measured_rad;
    measured_at_s_ = now_s;
    history_.emplace_back(now_s, *measured_);
    while (history_.front().first < now_s - kHistory_s) history_.pop_front();
  }
  if (status_.state != ActionState::kRunning || !measured_ || !command_) return;
  if (now_s - measured_at_s_ > options_.encoders_missing_s) {
    finish(ActionState::kFailed,
           fmt::format("no encoders from the arm for {:.1f} s", now_s - measured_at_s_));
    return;
  }
  Eigen::Index joint = 0;
  const double behind_rad = (*command_ - *measured_).cwiseAbs().maxCoeff(&joint);
  if (behind_rad < options_.blocked_rad) {
    is_behind_ = false;
    return;
  }
  if (!is_behind_) {
    is_behind_ = true;
    behind_since_s_ = now_s;
  }
  if (now_s - behind_since_s_ > options_.blocked_s) {
    is_behind_ = false;
    command_ = measured_;  // do not push on
    coast_rad_.setZero();
    finish(ActionState::kFailed,
           fmt::format("the arm is blocked: {} {} is {:.0f} degrees behind its target",
                       joint < kTorsoJoints ? "torso joint" : "arm joint",
                       joint < kTorsoJoints ? joint : joint - kTorsoJoints, behind_rad * 57.3));
  }
}

void ReachCore::take_sighting(const HandSighting& hand) {
  const auto then = posture_at(history_, hand.time_s);
  const auto before = posture_at(history_, hand.time_s - kStillOver_s);
  if (!then || !before || !hand.p_Root_m.allFinite() || hand.confidence < 0.3) return;
  if ((*then - *before).cwiseAbs().maxCoeff() > kStill_rad) return;
  const Eigen::Vector3d innovation_m =
      hand.p_Root_m - planner_.seen_hand().mark_Root_m(planner_.chain(), *then) - visual_offset_m_;
  if (innovation_m.norm() > options_.most_change_m) return;
  if (innovation_m.norm() > options_.most_innovation_m) {
    // one is a mistake; many that agree say that the eyes were bumped or the body is not what it was
    strange_sightings_ = (innovation_m - strange_m_).norm() < kAgree_m ? strange_sightings_ + 1 : 1;
    strange_m_ = innovation_m;
    if (strange_sightings_ < options_.sightings_to_notice) return;
    note_ = fmt::format("the hand is seen {:.0f} mm from where it is felt, time after time: I go by the eyes",
                        1000.0 * (innovation_m + visual_offset_m_).norm());
  }
  strange_sightings_ = 0;
  visual_offset_m_ += options_.sighting_gain * innovation_m;
  const double length_m = visual_offset_m_.norm();
  if (length_m > options_.most_visual_offset_m) visual_offset_m_ *= options_.most_visual_offset_m / length_m;
  planner_.set_visual_offset(visual_offset_m_);
  ++sightings_in_stage_;
}

const PalmPosture& ReachCore::grasp_posture(const std::string& object) const {
  const auto named = options_.grasp_postures.find(shape_of(object));
  if (named != options_.grasp_postures.end()) return named->second;
  const auto other = options_.grasp_postures.find("");
  return other != options_.grasp_postures.end() ? other->second : options_.reach_posture;
}

void ReachCore::begin(const ReachGoal& goal) {
  if (!command_) command_ = measured_;
  present_goal_.reset();
  const Status planned = plan(goal);
  if (!planned) finish(ActionState::kFailed, planned.error().message);
}

Status ReachCore::plan(const ReachGoal& goal) {
  const bool finite = goal.p_Root_m.allFinite() && goal.size_m.allFinite() && std::isfinite(goal.yaw_rad) &&
                      goal.p_Root_m.norm() < 100.0 && goal.size_m.minCoeff() >= 0.0 &&
                      goal.size_m.maxCoeff() < 10.0;
  if (!finite) {
    return Error{ErrorCode::kInvalidArgument, "goal '" + goal.action +
                                                  "': position, size or yaw is not a number that "
                                                  "can be (m, m, rad; sizes from 0)"};
  }
  if (goal.action == "correct") return plan_correction(goal);
  if (goal.action == "yield") return plan_yield();
  standing_.reset();
  if (goal.action == "stop") {
    finish(ActionState::kDone, "");
    return {};
  }
  if (goal.action == "home") return plan_home();
  if (goal.action == "lift") return plan_lift(goal);
  if (goal.action == "carry") return plan_carry(goal);
  if (goal.action == "point") return plan_point(goal);
  if (goal.action == "reach") return plan_approach(goal, options_.reach_posture);
  if (goal.action == "pregrasp") return plan_approach(goal, grasp_posture(goal.object));
  return Error{
      ErrorCode::kInvalidArgument,
      "action '" + goal.action +
          "' is unknown; reach knows reach, pregrasp, lift, carry, point, home, stop, correct, yield"};
}

Status ReachCore::plan_approach(const ReachGoal& goal, const PalmPosture& posture) {
  const Eigen::Vector3d offset_m = corrections_.offset_m(goal.action, goal.object, goal.p_Root_m);
  const SeenObject object{goal.object, goal.p_Root_m + offset_m, goal.size_m};
  // what was corrected is the hand's place when it is turned as it was then, round the thing
  PalmPosture turned = posture;
  if (!offset_m.isZero()) {
    const auto uncorrected =
        planner_.approach(posture, {goal.object, goal.p_Root_m, goal.size_m}, goal.yaw_rad, *command_);
    if (uncorrected) turned.turns_rad = {uncorrected->turn_rad};
  }
  auto approach = planner_.approach(turned, object, goal.yaw_rad, *command_);
  if (!approach && turned.turns_rad.size() < posture.turns_rad.size())
    approach = planner_.approach(posture, object, goal.yaw_rad, *command_);
  if (!approach) return approach.error();
  auto way = planner_.free_way(*command_, approach->q_standoff);
  if (!way) return Error{way.error().code, "to '" + goal.object + "': " + way.error().message};
  stages_.push_back(Move{std::move(*way), approach->standoff, true});
  stages_.push_back(Look{options_.look_s, approach->standoff});
  stages_.push_back(Straight{approach->goal, options_.approach_speed_m_s, 0.4});
  stages_.push_back(Look{options_.settle_s, approach->goal, options_.refinements});
  standing_ = Standing{goal.action, goal.object, goal.p_Root_m, offset_m, approach->goal};
  p_PalmHeld_m_ = approach->goal.X_RootPalm.inverse() * goal.p_Root_m;
  return {};
}

Status ReachCore::plan_point(const ReachGoal& goal) {
  PalmGoal mark;
  mark.p_PalmTool_m = planner_.seen_hand().p_PalmMark_m();
  // palm down where that costs nothing: then the eyes see the mark
  mark.X_RootPalm.linear() = options_.reach_posture.X_ObjectPalm.linear();
  mark.X_RootPalm.translation() = goal.p_Root_m - mark.X_RootPalm.linear() * mark.p_PalmTool_m;
  mark.turn_weight = Eigen::Vector3d::Constant(0.02);
  Joints there = Joints::Zero();
  if (options_.paper_network_alone) {
    const auto& network = planner_.postures();
    if (!network) return Error{ErrorCode::kNotFound, "the paper's network was not loaded"};
    there.segment<PostureNetwork::kOutputs>(kTorsoJoints) = network->posture_rad(goal.p_Root_m);
    there = planner_.chain().clamped(there);
  } else {
    auto posture = planner_.posture_for(mark, *command_);
    if (!posture) return posture.error();
    there = *posture;
  }
  auto way = planner_.free_way(*command_, there);
  if (!way) return way.error();
  stages_.push_back(Move{std::move(*way), mark, true});
  stages_.push_back(Look{options_.look_s, mark});
  if (!options_.paper_network_alone) {
    stages_.push_back(Straight{mark, options_.approach_speed_m_s, 0.4});
    stages_.push_back(Look{options_.settle_s, mark, options_.refinements});
  }
  return {};
}

Status ReachCore::plan_lift(const ReachGoal& goal) {
  PalmGoal lifted;
  lifted.p_PalmTool_m = p_PalmHeld_m_;
  lifted.turn_weight = Eigen::Vector3d(1.0, 1.0, 0.15);
  const Eigen::Isometry3d X_start = planner_.X_RootPalmSeen(*command_);
  const double asked_m = goal.p_Root_m.z() - (X_start * p_PalmHeld_m_).z();
  const double height_m = asked_m > 0.02 && asked_m < 0.25 ? asked_m : options_.lift_height_m;
  Status failure;
  for (const double share : {1.0, 0.8, 0.6}) {
    lifted.X_RootPalm = X_start;
    lifted.X_RootPalm.translation().z() += share * height_m;
    auto way = planner_.straight_way(*command_, lifted, options_.lift_speed_m_s, 0.4);
    if (way) {
      stages_.push_back(Move{std::move(*way), lifted, true});
      stages_.push_back(Look{options_.settle_s, lifted});
      return {};
    }
    failure = way.error();
  }
  return failure;
}

Status ReachCore::plan_carry(const ReachGoal& goal) {
  const Eigen::Vector3d held_Root_m = planner_.X_RootPalmSeen(*command_) * p_PalmHeld_m_;
  Error failure;
  // the palm keeps its tilt; a turn about the vertical does not shake the thing off, and helps the arm
  for (const double upright : {1.0, 0.4}) {
    for (const double lower_m : {0.0, 0.02, 0.04}) {
      const double height_m = goal.p_Root_m.z() - lower_m;
      const double transit_m = std::max(height_m, std::min(held_Root_m.z(), height_m + 0.05));
      const std::array<Eigen::Vector3d, 3> corners = {
          Eigen::Vector3d(held_Root_m.x(), held_Root_m.y(), transit_m),
          Eigen::Vector3d(goal.p_Root_m.x(), goal.p_Root_m.y(), transit_m),
          Eigen::Vector3d(goal.p_Root_m.x(), goal.p_Root_m.y(), height_m)};
      stages_.clear();
      Joints q = *command_;
      bool planned = true;
      for (const Eigen::Vector3d& corner : corners) {
        const Eigen::Isometry3d X_now = planner_.X_RootPalmSeen(q);
        if ((X_now * p_PalmHeld_m_ - corner).norm() < 0.003) continue;
        PalmGoal knot;
        knot.p_PalmTool_m = p_PalmHeld_m_;
        knot.turn_weight = Eigen::Vector3d(upright, upright, 0.02);
        knot.X_RootPalm.linear() = X_now.linear();
        knot.X_RootPalm.translation() = corner - X_now.linear() * p_PalmHeld_m_;
        auto way = planner_.straight_way(q, knot, options_.carry_speed_m_s, 0.5);
        if (!way) {
          failure = way.error();
          planned = false;
          break;
        }
        q = way->end();
        stages_.push_back(Move{std::move(*way), knot, true});
      }
      if (!planned) continue;
      PalmGoal there;
      there.X_RootPalm = planner_.X_RootPalmSeen(q);
      there.p_PalmTool_m = p_PalmHeld_m_;
      stages_.push_back(Look{options_.settle_s, there});
      return {};
    }
  }
  stages_.clear();
  return Error{failure.code, "cannot carry what is held there: " + failure.message};
}

Status ReachCore::plan_home() {
  auto way = planner_.free_way(*command_, planner_.options().home);
  if (!way) return Error{way.error().code, "on the way home: " + way.error().message};
  PalmGoal goal;
  goal.X_RootPalm = planner_.X_RootPalmSeen(planner_.options().home);
  stages_.push_back(Move{std::move(*way), goal, true});
  stages_.push_back(Look{options_.settle_s, goal});
  return {};
}

Status ReachCore::learn_correction(const Eigen::Vector3d& change_m) {
  Standing& standing = *standing_;
  const Eigen::Vector3d offset_m = standing.offset_m + change_m;
  if (Status learned = corrections_.learn(standing.action, standing.object, standing.p_Root_m, offset_m);
      !learned) {
    return learned;
  }
  standing.offset_m = offset_m;
  standing.goal.X_RootPalm.translation() += change_m;
  corrected_ = true;
  note_ = fmt::format("{} {}: {:.0f} mm to the right, {:.0f} mm back and {:.0f} mm up from now on",
                      standing.action, standing.object, 1000.0 * offset_m.y(), 1000.0 * offset_m.x(),
                      1000.0 * offset_m.z());
  return {};
}

Status ReachCore::plan_correction(const ReachGoal& goal) {
  if (!standing_)
    return Error{ErrorCode::kFailed, "there is nothing to correct: the hand was not brought to a thing"};
  Eigen::Vector3d change_m = goal.p_Root_m;
  if (goal.object == "closer") {
    const Eigen::Vector3d to_thing_m = standing_->p_Root_m - planner_.X_RootPalmSeen(*command_).translation();
    change_m = std::min(options_.correction_step_m, to_thing_m.norm()) * to_thing_m.normalized();
  } else if (const auto direction = direction_Root(goal.object)) {
    change_m = options_.correction_step_m * *direction;
  } else if (!goal.object.empty()) {
    return Error{
        ErrorCode::kInvalidArgument,
        "'" + goal.object + "' is no direction; allowed: left, right, up, down, forward, back, closer"};
  }
  const Eigen::Vector3d tool_m = standing_->goal.p_PalmTool_m;
  if ((planner_.X_RootPalmSeen(*command_) * tool_m - standing_->goal.X_RootPalm * tool_m).norm() >
      options_.corrected_from_m) {
    return Error{ErrorCode::kFailed,
                 "the hand is not at the " + standing_->object + ", so that there is nothing to correct"};
  }
  PalmGoal there = standing_->goal;
  there.X_RootPalm.translation() += change_m;
  auto way = planner_.straight_way(*command_, there, options_.approach_speed_m_s, 0.4);
  if (!way) return way.error();
  if (Status learned = learn_correction(change_m); !learned) return learned;
  stages_.push_back(Move{std::move(*way), there, true});
  stages_.push_back(Look{options_.settle_s, there, options_.refinements});
  return {};
}

Status ReachCore::plan_yield() {
  if (!standing_)
    return Error{ErrorCode::kFailed, "there is nothing to be led from: the hand was not brought to a thing"};
  stages_.push_back(Yield{});
  return {};
}

bool ReachCore::yield(Yield& yield, double now_s) {
  // gives way to what pushes it this far from its targets; following it all the way, the arm would drift on
  command_ = command_->array()
                 .max(measured_->array() - options_.give_way_rad)
                 .min(measured_->array() + options_.give_way_rad);
  if (!yield.start) yield.start = measured_;
  if ((*measured_ - yield.resting).cwiseAbs().maxCoeff() > kStill_rad) {
    yield.resting = *measured_;
    yield.resting_since_s = now_s;
  }
  const Eigen::Vector3d tool_m = standing_->goal.p_PalmTool_m;
  const Eigen::Vector3d led_m =
      planner_.X_RootPalmSeen(*measured_) * tool_m - planner_.X_RootPalmSeen(*yield.start) * tool_m;
  if (now_s - yield.resting_since_s > options_.led_rest_s && led_m.norm() > options_.led_m) {
    const Status learned = learn_correction(led_m);
    if (!learned) {
      finish(ActionState::kFailed, learned.error().message);
      return true;
    }
    return true;
  }
  return now_s - stage_begin_s_ > options_.yield_s;
}

void ReachCore::run_stages(double now_s) {
  while (!stages_.empty()) {
    if (!stage_begun_) {
      stage_begun_ = true;
      stage_begin_s_ = now_s;
      sightings_in_stage_ = 0;
      if (const auto* straight = std::get_if<Straight>(&stages_.front())) {
        auto way = planner_.straight_way(*command_, straight->goal, straight->speed_m_s,
                                         straight->joint_speed_share);
        if (!way) {
          finish(ActionState::kFailed, way.error().message);
          return;
        }
        stages_.front() = Move{std::move(*way), PalmGoal(straight->goal), true};
      }
    }
    const double t_s = now_s - stage_begin_s_;
    if (const auto* move = std::get_if<Move>(&stages_.front())) {
      present_goal_ = move->goal;
      command_ = move->path.at(t_s);
      if (t_s < move->path.duration_s()) return;
    } else if (const auto* look = std::get_if<Look>(&stages_.front())) {
      present_goal_ = look->goal;
      const bool is_in_view = now_s - hand_seen_at_s_ < kInView_s;
      const bool arrived = (*command_ - *measured_).cwiseAbs().maxCoeff() < options_.arrived_rad;
      const bool is_last_word = stages_.size() == 1 && (look->refinements == 0 || !is_in_view);
      const bool seen = is_last_word || sightings_in_stage_ >= kSightingsOfALook;
      if (t_s < look->most_s && !(arrived && seen)) return;
      if (look->refinements > 0 && stages_.size() == 1 && goal_error_m() > options_.refine_m) {
        const PalmGoal goal = look->goal;
        stages_.push_back(Straight{goal, options_.approach_speed_m_s, 0.4});
        stages_.push_back(Look{options_.settle_s, goal, look->refinements - 1});
      }
    } else if (auto* led = std::get_if<Yield>(&stages_.front())) {
      if (!yield(*led, now_s)) return;
      if (status_.state != ActionState::kRunning) return;
    }
    stages_.pop_front();
    stage_begun_ = false;
  }
  if (status_.state == ActionState::kRunning) finish(ActionState::kDone, "");
}

double ReachCore::goal_error_m() const {
  const PalmGoal& goal = *present_goal_;
  return (planner_.X_RootPalmSeen(*measured_) * goal.p_PalmTool_m - goal.X_RootPalm * goal.p_PalmTool_m)
      .norm();
}

void ReachCore::finish(ActionState state, const std::string& reason) {
  status_.state = state;
  status_.reason = reason;
  stages_.clear();
  stage_begun_ = false;
}

}  // namespace nido::reach
