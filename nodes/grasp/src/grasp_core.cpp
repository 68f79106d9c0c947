#include "nido/grasp/grasp_core.h"

#include <algorithm>
#include <cmath>

namespace nido::grasp {

namespace {

constexpr double kReachedTolerance_rad = 0.06;
constexpr double kMoveTimeout_s = 4.0;
constexpr double kStretchTimeout_s = 2.5;
// a finger counts as held open by something when it stays so far behind its target
constexpr double kBlocked_rad = 0.15;

double approach(double from, double to, double most) { return from + std::clamp(to - from, -most, most); }

}  // namespace

GraspCore::GraspCore(GraspOptions options, Policy policy)
    : options_(std::move(options)), policy_(std::move(policy)), target_(options_.rest) {
  desired_ = Eigen::VectorXd::Zero(kFingerCount);
}

const FingerPosture& GraspCore::preshape_of(const std::string& object) const {
  const std::string shape = object.substr(object.find_last_of(' ') + 1);
  if (const auto found = options_.preshape.find(shape); found != options_.preshape.end())
    return found->second;
  if (const auto found = options_.preshape.find(""); found != options_.preshape.end()) return found->second;
  return options_.rest;
}

GraspStatus GraspCore::status(const std::string& state, const std::string& reason) const {
  return {goal_.id, goal_.action, state, reason};
}

void GraspCore::start(const GraspGoal& goal, const GraspInputs& inputs) {
  goal_ = goal;
  elapsed_s_ = 0;
  if (!active_) target_ = inputs.measured;
  active_ = true;
  if (goal.action == "grasp") {
    phase_ = Phase::kClosing;
    decisions_made_ = 0;
    since_decision_s_ = options_.decision_period_s;
    nothing_felt_s_ = 0;
  } else if (goal.action == "open" || goal.action == "release") {
    phase_ = Phase::kMoving;
    if (goal.action == "open") {
      move_goal_ = preshape_of(goal.object);
    } else {
      // fingers stretch first while thumb and spread stay: a thumb that swings back while it is bent wedges
      // the thing against the palm
      phase_ = Phase::kStretching;
      move_goal_ = target_;
      for (std::size_t i = 1; i < kFingerCount; ++i) move_goal_.joint_rad[i] = options_.limits.lower_rad[i];
    }
  } else {
    phase_ = Phase::kIdle;
    target_ = inputs.measured;
  }
}

void GraspCore::move_towards(const FingerPosture& goal, double dt_s) {
  const double step = options_.speed_rad_s * dt_s;
  target_.spread_rad = approach(target_.spread_rad, goal.spread_rad, step);
  for (std::size_t i = 0; i < kFingerCount; ++i) {
    // joints with a larger range (coupled phalanges) move faster, so that a finger curls as one
    const double range = options_.limits.upper_rad[i] - options_.limits.lower_rad[i];
    target_.joint_rad[i] = approach(target_.joint_rad[i], goal.joint_rad[i], step * range / (M_PI / 2));
  }
}

void GraspCore::close_step(double dt_s, const GraspInputs& inputs) {
  since_decision_s_ += dt_s;
  if (decisions_made_ < options_.decisions && since_decision_s_ >= options_.decision_period_s - 1e-9) {
    since_decision_s_ = 0;
    Eigen::VectorXd touch(kPadCount);
    for (std::size_t i = 0; i < kPadCount; ++i)
      touch[static_cast<Eigen::Index>(i)] = inputs.touch[i] ? 1.0 : 0.0;
    desired_ = policy_(touch, decisions_made_ == 0);
    ++decisions_made_;
  }
  FingerPosture goal = target_;
  for (std::size_t i = 0; i < kFingerCount; ++i) {
    const double share = std::clamp(desired_[static_cast<Eigen::Index>(i)], 0.0, 1.0);
    goal.joint_rad[i] =
        options_.limits.lower_rad[i] + share * (options_.limits.upper_rad[i] - options_.limits.lower_rad[i]);
  }
  move_towards(goal, dt_s);
  bound_lead(inputs);
}

void GraspCore::bound_lead(const GraspInputs& inputs) {
  for (std::size_t i = 0; i < kFingerCount; ++i) {
    const bool felt = std::any_of(kPadOfFinger[i].begin(), kPadOfFinger[i].end(), [&](int pad) {
      return pad >= 0 && inputs.touch[static_cast<std::size_t>(pad)];
    });
    const double scale = (options_.limits.upper_rad[i] - options_.limits.lower_rad[i]) / (M_PI / 2);
    const double lead = (felt ? options_.touch_lead_rad : options_.lead_rad) * std::max(scale, 1.0);
    target_.joint_rad[i] = std::clamp(target_.joint_rad[i], inputs.measured.joint_rad[i] - lead,
                                      inputs.measured.joint_rad[i] + lead);
    target_.joint_rad[i] =
        std::clamp(target_.joint_rad[i], options_.limits.lower_rad[i], options_.limits.upper_rad[i]);
  }
}

double GraspCore::opening_rad(const GraspInputs& inputs) const {
  // sum over the flexing joints of how far something keeps them from their targets
  double sum = 0;
  for (std::size_t i = 1; i < kFingerCount; ++i) {
    const double lag = target_.joint_rad[i] - inputs.measured.joint_rad[i];
    if (lag > kBlocked_rad) sum += lag;
  }
  return sum;
}

bool GraspCore::feels_object(const GraspInputs& inputs) const {
  const auto pads = std::count(inputs.touch.begin(), inputs.touch.end(), true);
  return pads >= 2 || (pads >= 1 && opening_rad(inputs) > 2 * kBlocked_rad);
}

bool GraspCore::reached(const FingerPosture& goal, const GraspInputs& inputs) const {
  for (std::size_t i = 0; i < kFingerCount; ++i) {
    const double scale =
        std::max(1.0, (options_.limits.upper_rad[i] - options_.limits.lower_rad[i]) / (M_PI / 2));
    if (std::abs(goal.joint_rad[i] - inputs.measured.joint_rad[i]) > kReachedTolerance_rad * scale)
      return false;
  }
  return true;
}

GraspOutputs GraspCore::step(double dt_s, const GraspInputs& inputs) {
  GraspOutputs out;
  if (inputs.goal) {
    start(*inputs.goal, inputs);
    out.status = phase_ == Phase::kIdle ? status("done") : status("running");
  }
  elapsed_s_ += dt_s;
  switch (phase_) {
    case Phase::kIdle:
      break;
    case Phase::kStretching:
      move_towards(move_goal_, dt_s);
      // a finger that something stops in opening is no reason to stop a release
      if (reached(move_goal_, inputs) || elapsed_s_ > kStretchTimeout_s) {
        phase_ = Phase::kMoving;
        elapsed_s_ = 0;
        // then the hand's posture before any grasp, wider than a pre-shape, which may still carry a ball
        move_goal_ = options_.rest;
      }
      break;
    case Phase::kMoving:
      move_towards(move_goal_, dt_s);
      if (reached(move_goal_, inputs)) {
        phase_ = Phase::kIdle;
        out.status = status("done");
      } else if (elapsed_s_ > kMoveTimeout_s) {
        phase_ = Phase::kIdle;
        // an object in the way of opening fingers is no reason to stop a release
        out.status = goal_.action == "release"
                         ? status("done")
                         : status("failed", "the fingers did not open; something is in their way");
      }
      break;
    case Phase::kClosing:
      close_step(dt_s, inputs);
      if (decisions_made_ >= options_.decisions && since_decision_s_ >= options_.decision_period_s - 1e-9) {
        if (feels_object(inputs)) {
          phase_ = Phase::kHolding;
          out.status = status("done");
        } else {
          phase_ = Phase::kIdle;
          out.status = status("failed", "the fingers closed and felt no object");
        }
      }
      break;
    case Phase::kHolding:
      close_step(dt_s, inputs);
      nothing_felt_s_ = feels_object(inputs) ? 0.0 : nothing_felt_s_ + dt_s;
      if (nothing_felt_s_ > options_.lost_after_s) {
        phase_ = Phase::kIdle;
        out.status = status("failed", "the object slipped out of the hand");
      }
      break;
  }
  out.target = target_;
  out.active = active_;
  out.opening_rad = opening_rad(inputs);
  return out;
}

}  // namespace nido::grasp
