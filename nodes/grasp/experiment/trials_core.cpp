#include "trials_core.h"

namespace nido::grasp {

namespace {
constexpr double kPutSettle_s = 0.3;  // an object that was put down comes to rest
}

TrialsCore::TrialsCore(TrialOptions options, std::uint64_t seed)
    : options_(std::move(options)), random_(seed) {
  p_Root_m_ = options_.p_Root_m;
}

void TrialsCore::enter(Stage stage, TrialOutputs& out) {
  stage_ = stage;
  in_stage_s_ = 0;
  switch (stage) {
    case Stage::kHome:
      out.reach = TrialOutputs::Action{++id_, "home"};
      break;
    case Stage::kPut: {
      std::uniform_real_distribution<double> jitter(-options_.spread_m, options_.spread_m);
      const double dx = jitter(random_);
      const double dy = jitter(random_);
      p_Root_m_ = options_.p_Root_m + Eigen::Vector3d(dx, dy, 0);
      out.put_object_Root_m = p_Root_m_;
      result_ = TrialResult{result_.attempt + 1, options_.object, false, 0, 0.0};
      break;
    }
    case Stage::kOpen:
      out.grasp = TrialOutputs::Action{++id_, "open"};
      break;
    case Stage::kApproach:
      out.reach = TrialOutputs::Action{++id_, "pregrasp"};
      break;
    case Stage::kClose:
      out.grasp = TrialOutputs::Action{++id_, "grasp"};
      break;
    case Stage::kLift:
      out.reach = TrialOutputs::Action{++id_, "lift"};
      break;
    case Stage::kHold:
      break;
    case Stage::kRelease:
      out.grasp = TrialOutputs::Action{++id_, "release"};
      break;
  }
}

bool TrialsCore::ended(const std::optional<TrialInputs::Done>& status, bool& well) const {
  if (status && status->id == id_ && status->state != "running") {
    well = status->state == "done";
    return true;
  }
  well = false;
  return in_stage_s_ > options_.stage_timeout_s;
}

TrialOutputs TrialsCore::step(double dt_s, const TrialInputs& inputs) {
  TrialOutputs out;
  in_stage_s_ += dt_s;
  if (!begun_) {
    begun_ = true;
    enter(Stage::kHome, out);
    return out;
  }
  bool well = false;
  switch (stage_) {
    case Stage::kHome:
      if (ended(inputs.reach, well)) {
        if (result_.attempt >= options_.attempts) {
          out.finished = true;
        } else {
          enter(Stage::kPut, out);
        }
      }
      break;
    case Stage::kPut:
      if (in_stage_s_ >= kPutSettle_s) enter(Stage::kOpen, out);
      break;
    case Stage::kOpen:
      if (ended(inputs.grasp, well)) enter(Stage::kApproach, out);
      break;
    case Stage::kApproach:
      if (ended(inputs.reach, well)) enter(Stage::kClose, out);
      break;
    case Stage::kClose:
      // lifted whatever the hand thinks that it has: gravity decides
      if (ended(inputs.grasp, well)) {
        result_.closed_on_it = well;
        enter(Stage::kLift, out);
      }
      break;
    case Stage::kLift:
      if (ended(inputs.reach, well)) enter(Stage::kHold, out);
      break;
    case Stage::kHold: {
      const bool up = inputs.object_height_m > p_Root_m_.z() + options_.up_m;
      if (up) ++result_.steps_held;
      if (!up || result_.steps_held >= options_.test_steps) {
        result_.reward = static_cast<double>(result_.steps_held) / options_.test_steps;
        out.result = result_;
        enter(Stage::kRelease, out);
      }
      break;
    }
    case Stage::kRelease:
      if (ended(inputs.grasp, well)) enter(Stage::kHome, out);
      break;
  }
  return out;
}

}  // namespace nido::grasp
