#include "nido/textproto/task_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "task_words.h"

namespace nido {
namespace {

using namespace task_words;

constexpr std::size_t kChainJoints = 10;

// X Y Z [QX QY QZ QW]
Result<CartesianGoal> goal_from(std::span<const double> n) {
  CartesianGoal goal;
  if (n.size() == 3) {
    goal.with_orientation = false;
    goal.X_RootPalm.translation() = Eigen::Vector3d(n[0], n[1], n[2]);
    return goal;
  }
  if (n.size() != 7) {
    return Error{ErrorCode::kInvalidArgument,
                 "X Y Z in m, and for a pose QX QY QZ QW of its turn, are expected"};
  }
  const Result<Eigen::Isometry3d> pose = pose_from(n);
  if (!pose) return pose.error();
  goal.X_RootPalm = *pose;
  return goal;
}

std::vector<double> radians(const std::vector<double>& degrees, std::size_t first, std::size_t count) {
  std::vector<double> out;
  for (std::size_t i = first; i < first + count; ++i) out.push_back(degrees.at(i) * kDegree_rad);
  return out;
}

// (MOVES) (LOWER) (UPPER) (RESTS) (REST) (X Y Z QX QY QZ QW), by joint
std::string settings_words(const CartesianSettings& settings) {
  std::vector<double> moves(settings.moves.begin(), settings.moves.end());
  std::vector<double> rests;
  std::vector<double> rest_rad;
  for (const std::optional<double>& rest : settings.rest_rad) {
    rests.push_back(rest ? 1 : 0);
    rest_rad.push_back(rest.value_or(0));
  }
  return fmt::format("{} {} {} {} {} {}", list(moves), degrees(settings.lower_rad),
                     degrees(settings.upper_rad), list(rests), degrees(rest_rad),
                     list(pose_numbers(settings.X_PalmTip)));
}
Result<CartesianSettings> cartesian_settings(const Values& words) {
  constexpr std::size_t n = kChainJoints;
  const auto numbers = flat(words, {n, n, n, n, n, 7});
  if (!numbers) {
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("(MOVES) (LOWER) (UPPER) (RESTS) (REST) of {} joints and (X Y Z QX QY QZ QW) are "
                    "expected",
                    n)};
  }
  const Result<CartesianGoal> tip = goal_from(std::span(*numbers).subspan(5 * n, 7));
  if (!tip) return tip.error();
  CartesianSettings settings;
  for (std::size_t j = 0; j < n; ++j) {
    settings.moves.push_back((*numbers)[j] != 0);
    settings.rest_rad.push_back(
        (*numbers)[3 * n + j] != 0 ? std::optional((*numbers)[4 * n + j] * kDegree_rad) : std::nullopt);
  }
  settings.lower_rad = radians(*numbers, n, n);
  settings.upper_rad = radians(*numbers, 2 * n, n);
  settings.X_PalmTip = tip->X_RootPalm;
  return settings;
}

// NECK_S EYES_S (LOWER) (UPPER) SHARE (VERGENCE) (FROM APART_S), the last two empty where there are none
std::string settings_words(const GazeSettings& settings) {
  const auto& saccades = settings.saccades;
  return fmt::format(
      "{} {} {} {} {} ({}) ({})", format_number(settings.neck_s), format_number(settings.eyes_s),
      degrees(settings.neck_lower_rad), degrees(settings.neck_upper_rad),
      format_number(settings.eyes_make_up),
      settings.vergence_rad ? format_number(*settings.vergence_rad / kDegree_rad) : "",
      saccades ? format_number(saccades->from_rad / kDegree_rad) + " " + format_number(saccades->apart_s)
               : "");
}
Result<GazeSettings> gaze_settings(const Values& words) {
  const auto n = flat(words, {0, 0, 3, 3, 0});
  const auto vergence = numbers_of_list(words, 5);
  const auto saccades = numbers_of_list(words, 6);
  if (!n || !vergence || vergence->size() > 1 || !saccades || (!saccades->empty() && saccades->size() != 2)) {
    return Error{ErrorCode::kInvalidArgument,
                 "NECK_SECONDS EYES_SECONDS (LOWER) (UPPER) SHARE (VERGENCE) (FROM APART_SECONDS) are "
                 "expected, degrees, pitch roll yaw; () for no vergence, no saccades"};
  }
  GazeSettings settings;
  settings.neck_s = (*n)[0];
  settings.eyes_s = (*n)[1];
  for (Eigen::Index j = 0; j < 3; ++j) {
    settings.neck_lower_rad[j] = (*n)[2 + static_cast<std::size_t>(j)] * kDegree_rad;
    settings.neck_upper_rad[j] = (*n)[5 + static_cast<std::size_t>(j)] * kDegree_rad;
  }
  settings.eyes_make_up = (*n)[8];
  if (!vergence->empty()) settings.vergence_rad = vergence->front() * kDegree_rad;
  if (!saccades->empty()) settings.saccades = {saccades->front() * kDegree_rad, saccades->back()};
  return settings;
}

class AskedCartesian final : public ICartesianControl {
 public:
  explicit AskedCartesian(AskLine ask) : ask_(std::move(ask)) {}

  Result<CartesianState> state() const override {
    const Result<Values> words = answered(ask_, "get state");
    if (!words) return words.error();
    const auto n = flat(*words, {0, 0, 7, 0, 0, 0, kChainJoints, 3, 3, 0});
    if (!n) return strange();
    const Result<CartesianGoal> pose = goal_from(std::span(*n).subspan(2, 7));
    if (!pose) return strange();
    CartesianState state{std::llround((*n)[0] * 1e9),
                         pose->X_RootPalm,
                         (*n)[1] != 0,
                         (*n)[9],
                         (*n)[10] * kDegree_rad,
                         (*n)[11],
                         radians(*n, 12, kChainJoints)};
    const std::size_t speed = 12 + kChainJoints;
    state.v_m_s = {(*n)[speed], (*n)[speed + 1], (*n)[speed + 2]};
    state.w_rad_s = kDegree_rad * Eigen::Vector3d((*n)[speed + 3], (*n)[speed + 4], (*n)[speed + 5]);
    state.motion = static_cast<std::uint32_t>(std::clamp((*n)[speed + 6], 0.0, 4e9));
    return state;
  }
  Result<CartesianPlan> plan(const CartesianGoal& goal) const override {
    if (Status valid = check(goal); !valid) return valid.error();
    const Result<Values> words = answered(ask_, "plan " + goal_words(goal));
    if (!words) return words.error();
    const auto n = flat(*words, {kChainJoints, 0, 0, 7});
    const Result<CartesianGoal> there = n ? goal_from(std::span(*n).subspan(kChainJoints + 2, 7)) : strange();
    if (!there) return strange();
    CartesianPlan plan;
    plan.joints_rad = radians(*n, 0, kChainJoints);
    plan.position_error_m = (*n)[kChainJoints];
    plan.turn_error_rad = (*n)[kChainJoints + 1] * kDegree_rad;
    plan.X_RootPalm = there->X_RootPalm;
    return plan;
  }
  Status go_to(const CartesianGoal& goal) override {
    if (Status valid = check(goal); !valid) return valid;
    return ordered(ask_, fmt::format("go {} in {}", goal_words(goal), format_number(goal.duration_s)));
  }
  Status go_on(const Eigen::Vector3d& v_m_s, const Eigen::Vector3d& w_rad_s, double for_s) override {
    if (!v_m_s.allFinite() || !w_rad_s.allFinite() || !std::isfinite(for_s)) {
      return Error{ErrorCode::kInvalidArgument, "a speed has finite numbers"};
    }
    return ordered(ask_,
                   fmt::format("go on {} {} for {}", list(v_m_s), degrees(w_rad_s), format_number(for_s)));
  }
  Status stop() override { return ordered(ask_, "stop"); }
  Result<Eigen::Isometry3d> X_RootLink(int joint_from_root) const override {
    const Result<Values> words = answered(ask_, fmt::format("get link {}", joint_from_root));
    if (!words) return words.error();
    const auto n = flat(*words, {7});
    const Result<CartesianGoal> pose = n ? goal_from(*n) : strange();
    return pose ? Result<Eigen::Isometry3d>(pose->X_RootPalm) : strange();
  }
  Result<CartesianSettings> settings() const override {
    const Result<Values> words = answered(ask_, "get settings");
    return words ? cartesian_settings(*words) : words.error();
  }
  Status set_settings(const CartesianSettings& settings) override {
    return ordered(ask_, "set settings " + settings_words(settings));
  }

 private:
  static Status check(const CartesianGoal& goal) {
    // what cannot be written down
    if (goal.X_RootPalm.matrix().allFinite() && std::isfinite(goal.duration_s)) return {};
    return Error{ErrorCode::kInvalidArgument, "a goal of the hand has finite numbers"};
  }
  static std::string goal_words(const CartesianGoal& goal) {
    const std::array<double, 7> n = pose_numbers(goal.X_RootPalm);
    std::string words;
    for (std::size_t i = 0; i < (goal.with_orientation ? 7U : 3U); ++i) {
      words += (i > 0 ? " " : "") + format_number(n[i]);
    }
    return words;
  }
  AskLine ask_;
};

class AskedGaze final : public IGazeControl {
 public:
  explicit AskedGaze(AskLine ask) : ask_(std::move(ask)) {}

  Result<GazeState> state() const override {
    const Result<Values> words = answered(ask_, "get state");
    if (!words) return words.error();
    const auto n = flat(*words, {0, 0, 3, 0, 3, 3, 6, 7, 7, 0, 6, 6, 7});
    if (!n) return strange();
    GazeState state{std::llround((*n)[0] * 1e9), {(*n)[2], (*n)[3], (*n)[4]}, (*n)[1] != 0, (*n)[5]};
    state.progress = (*n)[32];
    for (Eigen::Index i = 0; i < 6; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (i < 3) state.angles_rad[i] = (*n)[6 + at] * kDegree_rad;
      if (i < 3) state.torso_rad[i] = (*n)[9 + at] * kDegree_rad;
      state.head_rad[i] = (*n)[12 + at] * kDegree_rad;
      state.wanted_rad[i] = (*n)[33 + at] * kDegree_rad;
      state.velocities_rad_s[i] = (*n)[39 + at] * kDegree_rad;
    }
    for (const auto& [frame, at] :
         {std::pair{&state.X_RootEyes[0], 18U}, {&state.X_RootEyes[1], 25U}, {&state.X_RootHead, 45U}}) {
      const Result<CartesianGoal> pose = goal_from(std::span(*n).subspan(at, 7));
      if (!pose) return strange();
      *frame = pose->X_RootPalm;
    }
    return state;
  }
  Status look_at(const Eigen::Vector3d& p_Root_m) override {
    if (!p_Root_m.allFinite()) return Error{ErrorCode::kInvalidArgument, "a point has finite numbers"};
    return ordered(ask_, fmt::format("look at {} {} {}", format_number(p_Root_m.x()),
                                     format_number(p_Root_m.y()), format_number(p_Root_m.z())));
  }
  Status look_at_pixel(int eye, const Eigen::Vector2d& px, double distance_m) override {
    if ((eye != 0 && eye != 1) || !px.allFinite() || !std::isfinite(distance_m)) {
      return Error{ErrorCode::kInvalidArgument, "eye 0 or 1 and finite numbers are expected"};
    }
    return ordered(ask_,
                   fmt::format("look pixel {} {} {} {}", eye == 0 ? "left" : "right", format_number(px.x()),
                               format_number(px.y()), format_number(distance_m)));
  }
  Status look_at_pixels(const Eigen::Vector2d& left_px, const Eigen::Vector2d& right_px) override {
    if (!left_px.allFinite() || !right_px.allFinite()) {
      return Error{ErrorCode::kInvalidArgument, "finite numbers are expected"};
    }
    return ordered(
        ask_, fmt::format("look pixels {} {} {} {}", format_number(left_px.x()), format_number(left_px.y()),
                          format_number(right_px.x()), format_number(right_px.y())));
  }
  Status look_by_angles(bool relative, const Eigen::Vector3d& angles_rad) override {
    if (!angles_rad.allFinite()) return Error{ErrorCode::kInvalidArgument, "finite angles are expected"};
    return ordered(ask_, fmt::format("look angles {} {} {} {}", relative ? "rel" : "abs",
                                     format_number(angles_rad.x() / kDegree_rad),
                                     format_number(angles_rad.y() / kDegree_rad),
                                     format_number(angles_rad.z() / kDegree_rad)));
  }
  Status stop() override { return ordered(ask_, "stop"); }
  Result<GazeBody> body() const override {
    const Result<Values> words = answered(ask_, "get body");
    if (!words) return words.error();
    const auto n = flat(*words, {0, 0, 0, 7, 0, 3, 3, 0});
    const Result<CartesianGoal> ahead = n ? goal_from(std::span(*n).subspan(3, 7)) : strange();
    if (!ahead) return strange();
    const auto three_rad = [&](std::size_t at) -> Eigen::Vector3d {
      return kDegree_rad * Eigen::Vector3d((*n)[at], (*n)[at + 1], (*n)[at + 2]);
    };
    return GazeBody{static_cast<int>((*n)[0]),
                    static_cast<int>((*n)[1]),
                    (*n)[2],
                    ahead->X_RootPalm,
                    (*n)[10],
                    three_rad(11),
                    three_rad(14),
                    (*n)[17] * kDegree_rad};
  }
  Result<GazeSettings> settings() const override {
    const Result<Values> words = answered(ask_, "get settings");
    return words ? gaze_settings(*words) : words.error();
  }
  Status set_settings(const GazeSettings& settings) override {
    return ordered(ask_, "set settings " + settings_words(settings));
  }

 private:
  AskLine ask_;
};

}  // namespace

std::string cartesian_reply(ICartesianControl& hand, const std::string& line) {
  const Result<Values> parsed = parse_text(line);
  if (!parsed) return fail(parsed.error().message);
  const Values& words = *parsed;
  const auto is = [&](std::size_t at, std::string_view text) {
    return at < words.size() && words[at].is_word(text);
  };
  if (is(0, "stop") && words.size() == 1) return outcome(hand.stop());
  if (is(0, "get") && is(1, "state") && words.size() == 2) {
    const Result<CartesianState> state = hand.state();
    if (!state) return fail(state.error().message);
    return fmt::format("[is] state {} {} {} {} {} {} {} {} {} {} [ok]",
                       format_number(static_cast<double>(state->stamp_ns) * 1e-9), state->moving ? 1 : 0,
                       list(pose_numbers(state->X_RootPalm)), format_number(state->position_error_m),
                       format_number(state->turn_error_rad / kDegree_rad), format_number(state->progress),
                       degrees(state->velocities_rad_s), list(state->v_m_s), degrees(state->w_rad_s),
                       state->motion);
  }
  if (is(0, "get") && is(1, "link") && words.size() == 3) {
    const auto* joint = std::get_if<long long>(&words[2].content);
    const auto X =
        hand.X_RootLink(joint != nullptr ? static_cast<int>(std::clamp(*joint, -1LL, 1000LL)) : -1);
    return X ? "[is] link " + list(pose_numbers(*X)) + " [ok]" : fail(X.error().message);
  }
  if (is(0, "get") && is(1, "settings") && words.size() == 2) {
    const Result<CartesianSettings> settings = hand.settings();
    return settings ? "[is] settings " + settings_words(*settings) + " [ok]" : fail(settings.error().message);
  }
  if (is(0, "set") && is(1, "settings")) {
    const Result<CartesianSettings> settings = cartesian_settings({words.begin() + 2, words.end()});
    return settings ? outcome(hand.set_settings(*settings)) : fail(settings.error().message);
  }
  if (is(0, "go") && is(1, "on")) {
    const auto n = flat({words.begin() + 2, words.end()}, {3, 3});
    const bool timed = words.size() == 6 && is(4, "for") && words[5].is_number();
    if (!n || !(timed || words.size() == 4)) {
      return fail("go on (VX VY VZ) (WX WY WZ) [for SECONDS], m/s and degrees/s, is expected");
    }
    return outcome(hand.go_on({(*n)[0], (*n)[1], (*n)[2]},
                              kDegree_rad * Eigen::Vector3d((*n)[3], (*n)[4], (*n)[5]),
                              timed ? words[5].number() : kTaskSpeedHolds_s));
  }
  if (is(0, "go") || is(0, "plan")) {
    const std::vector<double> numbers = numbers_from(words, 1);
    Result<CartesianGoal> goal = goal_from(numbers);
    if (!goal) return fail(goal.error().message);
    const std::size_t next = 1 + numbers.size();
    if (is(next, "in") && words.size() == next + 2 && words[next + 1].is_number()) {
      goal->duration_s = words[next + 1].number();
    } else if (words.size() != next) {
      return fail("after the goal comes nothing, or 'in' and a time in seconds");
    }
    if (is(0, "go")) return outcome(hand.go_to(*goal));
    const Result<CartesianPlan> plan = hand.plan(*goal);
    if (!plan) return fail(plan.error().message);
    return fmt::format(
        "[is] plan {} {} {} {} [ok]", degrees(plan->joints_rad), format_number(plan->position_error_m),
        format_number(plan->turn_error_rad / kDegree_rad), list(pose_numbers(plan->X_RootPalm)));
  }
  return fail(
      "go X Y Z [QX QY QZ QW] [in SECONDS], go on (VX VY VZ) (WX WY WZ) [for SECONDS], plan X Y Z [QX QY QZ "
      "QW], get "
      "state, "
      "get link JOINT, get settings, set settings and stop are understood");
}

std::string gaze_reply(IGazeControl& gaze, const std::string& line) {
  const Result<Values> parsed = parse_text(line);
  if (!parsed) return fail(parsed.error().message);
  const Values& words = *parsed;
  const auto is = [&](std::size_t at, std::string_view text) {
    return at < words.size() && words[at].is_word(text);
  };
  if (is(0, "stop") && words.size() == 1) return outcome(gaze.stop());
  if (is(0, "get") && is(1, "state") && words.size() == 2) {
    const Result<GazeState> state = gaze.state();
    if (!state) return fail(state.error().message);
    return fmt::format("[is] state {} {} {} {} {} {} {} {} {} {} {} {} {} [ok]",
                       format_number(static_cast<double>(state->stamp_ns) * 1e-9), state->moving ? 1 : 0,
                       list(state->p_RootFixation_m), format_number(state->error_px),
                       degrees(state->angles_rad), degrees(state->torso_rad), degrees(state->head_rad),
                       list(pose_numbers(state->X_RootEyes[0])), list(pose_numbers(state->X_RootEyes[1])),
                       format_number(state->progress), degrees(state->wanted_rad),
                       degrees(state->velocities_rad_s), list(pose_numbers(state->X_RootHead)));
  }
  if (is(0, "get") && is(1, "body") && words.size() == 2) {
    const Result<GazeBody> body = gaze.body();
    if (!body) return fail(body.error().message);
    return fmt::format("[is] body {} {} {} {} {} {} {} {} [ok]", body->width_px, body->height_px,
                       format_number(body->focal_px), list(pose_numbers(body->X_RootAhead)),
                       format_number(body->baseline_m), degrees(body->neck_lower_rad),
                       degrees(body->neck_upper_rad), format_number(body->vergence_upper_rad / kDegree_rad));
  }
  if (is(0, "get") && is(1, "settings") && words.size() == 2) {
    const Result<GazeSettings> settings = gaze.settings();
    return settings ? "[is] settings " + settings_words(*settings) + " [ok]" : fail(settings.error().message);
  }
  if (is(0, "set") && is(1, "settings")) {
    const Result<GazeSettings> settings = gaze_settings({words.begin() + 2, words.end()});
    return settings ? outcome(gaze.set_settings(*settings)) : fail(settings.error().message);
  }
  if (is(0, "look") && is(1, "pixels")) {
    const std::vector<double> n = numbers_from(words, 2);
    if (n.size() != 4 || words.size() != 6) return fail("look pixels UL VL UR VR, in pixels, is expected");
    return outcome(gaze.look_at_pixels({n[0], n[1]}, {n[2], n[3]}));
  }
  if (is(0, "look") && is(1, "angles") && (is(2, "abs") || is(2, "rel"))) {
    const std::vector<double> n = numbers_from(words, 3);
    if (n.size() != 3 || words.size() != 6) {
      return fail("look angles abs|rel AZIMUTH ELEVATION VERGENCE, in degrees, is expected");
    }
    return outcome(gaze.look_by_angles(is(2, "rel"), Eigen::Vector3d(n[0], n[1], n[2]) * kDegree_rad));
  }
  if (is(0, "look") && is(1, "at")) {
    const std::vector<double> n = numbers_from(words, 2);
    if (n.size() != 3 || words.size() != 5) return fail("look at X Y Z, in m, is expected");
    return outcome(gaze.look_at({n[0], n[1], n[2]}));
  }
  if (is(0, "look") && is(1, "pixel") && (is(2, "left") || is(2, "right"))) {
    const std::vector<double> n = numbers_from(words, 3);
    if (n.size() != 3 || words.size() != 6) {
      return fail("look pixel left|right U V DISTANCE, in pixels and m, is expected");
    }
    return outcome(gaze.look_at_pixel(is(2, "left") ? 0 : 1, {n[0], n[1]}, n[2]));
  }
  return fail(
      "look at X Y Z, look pixel left|right U V DISTANCE, look pixels UL VL UR VR, look angles abs|rel "
      "AZIMUTH ELEVATION VERGENCE, get state, get body, get settings, set settings and stop are understood");
}

std::unique_ptr<ICartesianControl> asked_cartesian(AskLine ask) {
  return std::make_unique<AskedCartesian>(std::move(ask));
}
std::unique_ptr<IGazeControl> asked_gaze(AskLine ask) { return std::make_unique<AskedGaze>(std::move(ask)); }

}  // namespace nido
