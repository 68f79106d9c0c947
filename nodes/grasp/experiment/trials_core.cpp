#include "trials_core.h"

#include <algorithm>
#include <array>

namespace nido::grasp {

namespace {
constexpr double kPutSettle_s = 0.3;  // an object that was put down comes to rest
constexpr double kAsideSpacing_m = 0.10;
constexpr int kPullSteps = 5;        // the pull is renewed so often
constexpr int kDirectionSteps = 25;  // and changes its direction after so many
constexpr double kStep_s = 0.01;
}  // namespace

TrialsCore::TrialsCore(TrialOptions options, std::vector<double> rest_height_m, std::uint64_t seed)
    : options_(std::move(options)), rest_height_m_(std::move(rest_height_m)), random_(seed) {
  p_Root_m_ = options_.p_Root_m;
}

TrialOutputs::Action TrialsCore::action(const std::string& name) const {
  return {id_, name, object(), {p_Root_m_.x(), p_Root_m_.y(), rest_height_m_[which_]}};
}

void TrialsCore::enter(Stage stage, TrialOutputs& out) {
  stage_ = stage;
  in_stage_s_ = 0;
  std::uniform_real_distribution<double> jitter(-1.0, 1.0);
  switch (stage) {
    case Stage::kHome:
      ++id_;
      out.reach = action("home");
      break;
    case Stage::kAside:
      out.put = TrialOutputs::Put{
          object(),
          options_.p_aside_Root_m + Eigen::Vector2d(0, kAsideSpacing_m * static_cast<double>(which_)), 0.0};
      break;
    case Stage::kApproach: {
      const int attempt = result_.attempt;
      which_ = static_cast<std::size_t>(attempt) % options_.objects.size();
      const double dx = jitter(random_);
      const double dy = jitter(random_);
      p_Root_m_ = options_.p_Root_m + options_.spread_m * Eigen::Vector2d(dx, dy);
      result_ = TrialResult{attempt + 1, object(), "", false, 0, 0.0};
      ++id_;
      hand_open_ = false;
      hand_there_ = false;
      out.grasp = action("open");
      out.reach = action("pregrasp");
      break;
    }
    case Stage::kPut: {
      const double dx = jitter(random_);
      const double dy = jitter(random_);
      const double turn = jitter(random_);
      out.put = TrialOutputs::Put{object(), p_Root_m_ + options_.off_m * Eigen::Vector2d(dx, dy),
                                  options_.turn_rad * turn};
      break;
    }
    case Stage::kClose:
      ++id_;
      out.grasp = action("grasp");
      break;
    case Stage::kLift:
      ++id_;
      out.reach = action("lift");
      out.reach->p_Root_m.z() += options_.lift_m;
      break;
    case Stage::kHold:
      break;
    case Stage::kRelease:
      ++id_;
      out.grasp = action("release");
      break;
  }
}

bool TrialsCore::ended(const std::optional<TrialInputs::Done>& status, bool& well) {
  if (status && status->id == id_ && status->state != "running") {
    well = status->state == "done";
    if (!well) reason_ = status->reason;
    return true;
  }
  well = false;
  if (in_stage_s_ <= options_.stage_timeout_s) return false;
  reason_ = "no end of the action in time";
  return true;
}

void TrialsCore::end_attempt(TrialOutputs& out) {
  result_.reward = static_cast<double>(result_.steps_held) / options_.test_steps;
  out.result = result_;
  enter(Stage::kRelease, out);
}

std::optional<TrialOutputs::Pull> TrialsCore::pull() const {
  if (options_.pull_N <= 0 || result_.steps_held % kPullSteps != 0) return {};
  // down, left, forward, right, back
  static const std::array<Eigen::Vector3d, 5> kDirections = {
      -Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitY(), -Eigen::Vector3d::UnitX(),
      Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitX()};
  const auto which = static_cast<std::size_t>(result_.steps_held / kDirectionSteps) % kDirections.size();
  const double share = static_cast<double>(result_.steps_held + kPullSteps) / options_.test_steps;
  return TrialOutputs::Pull{object(), options_.pull_N * std::min(1.0, share) * kDirections[which],
                            kPullSteps * kStep_s};
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
      if (ended(inputs.reach, well)) enter(Stage::kAside, out);
      break;
    case Stage::kAside:
      if (result_.attempt >= options_.attempts || (options_.until_max && result_.reward >= 1.0)) {
        out.finished = true;
      } else {
        enter(Stage::kApproach, out);
      }
      break;
    case Stage::kApproach:
      if (!hand_open_ && ended(inputs.grasp, well)) hand_open_ = true;
      if (!hand_there_ && ended(inputs.reach, well)) {
        hand_there_ = true;
        if (!well) {  // not the fingers' fault
          result_.trouble = reason_;
          end_attempt(out);
          break;
        }
      }
      if (hand_open_ && hand_there_) enter(Stage::kPut, out);
      break;
    case Stage::kPut:
      if (in_stage_s_ >= kPutSettle_s) enter(Stage::kClose, out);
      break;
    case Stage::kClose:
      // lifted whatever the hand thinks that it has: gravity decides
      if (ended(inputs.grasp, well)) {
        result_.closed_on_it = well;
        enter(Stage::kLift, out);
      }
      break;
    case Stage::kLift:
      if (ended(inputs.reach, well)) {
        if (well) {
          enter(Stage::kHold, out);
        } else {
          result_.trouble = reason_;
          end_attempt(out);
        }
      }
      break;
    case Stage::kHold: {
      const bool up =
          inputs.object_height_m > rest_height_m_[which_] + options_.up_m && !inputs.borne_by_other;
      if (up) out.pull = pull();
      if (up) ++result_.steps_held;
      if (!up || result_.steps_held >= options_.test_steps) end_attempt(out);
      break;
    }
    case Stage::kRelease:
      // the next attempt begins from where the hand is; after trouble from home
      if (ended(inputs.grasp, well)) enter(result_.trouble.empty() ? Stage::kAside : Stage::kHome, out);
      break;
  }
  return out;
}

}  // namespace nido::grasp
