#include "nido/textproto/task_text.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "nido/textproto/text_value.h"

namespace nido {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180.0;
using Values = std::vector<TextValue>;

std::string fail(const std::string& reason) {
  return format_text({TextValue{TextValue::Word{"fail", true}}, TextValue{reason}});
}
std::string outcome(const Status& status) { return status ? "[ok]" : fail(status.error().message); }

std::string list(std::span<const double> numbers) {
  std::string text = "(";
  for (const double number : numbers) text += (text.size() > 1 ? " " : "") + format_number(number);
  return text + ")";
}

// the words of a line that begins with `first`, as numbers; a bare word in their midst ends them
std::vector<double> numbers_from(const Values& words, std::size_t first) {
  std::vector<double> numbers;
  for (std::size_t i = first; i < words.size() && words[i].is_number(); ++i) {
    numbers.push_back(words[i].number());
  }
  return numbers;
}

std::array<double, 7> pose_numbers(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  return {X.translation().x(), X.translation().y(), X.translation().z(), q.x(), q.y(), q.z(), q.w()};
}

// X Y Z [QX QY QZ QW]
Result<CartesianGoal> goal_from(std::span<const double> n) {
  if (n.size() != 3 && n.size() != 7) {
    return Error{ErrorCode::kInvalidArgument,
                 "X Y Z in m, and for a pose QX QY QZ QW of its turn, are expected"};
  }
  CartesianGoal goal;
  goal.with_orientation = n.size() == 7;
  goal.X_RootPalm.translation() = Eigen::Vector3d(n[0], n[1], n[2]);
  if (goal.with_orientation) {
    const Eigen::Quaterniond q(n[6], n[3], n[4], n[5]);
    if (!(std::abs(q.norm() - 1.0) < 0.01)) {
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("a turn is a quaternion x y z w of length 1, not {:.3g}", q.norm())};
    }
    goal.X_RootPalm.linear() = q.normalized().toRotationMatrix();
  }
  return goal;
}

// the answer's words after [is] and what was asked
Result<Values> answered(const AskLine& ask, const std::string& line) {
  const Result<std::string> answer = ask(line);
  if (!answer) return answer.error();
  Result<Values> words = parse_text(*answer);
  if (!words || words->empty()) {
    return Error{ErrorCode::kFailed, fmt::format("the answer to '{}' is not understood", line)};
  }
  if (words->front().is_word("ok")) return Values{};
  if (!words->front().is_word("is") || words->size() < 3) {
    const std::string* reason = words->size() > 1 ? (*words)[1].text() : nullptr;
    return Error{ErrorCode::kFailed, reason != nullptr ? *reason : "refused: " + line};
  }
  words->erase(words->begin(), words->begin() + 2);
  return words;
}

Status ordered(const AskLine& ask, const std::string& line) {
  const Result<Values> words = answered(ask, line);
  return words ? Status() : Status(words.error());
}

// numbers and lists of numbers, in this order; each entry of `shape` is the length of a list, 0 for a number
std::optional<std::vector<double>> flat(const Values& words, std::initializer_list<std::size_t> shape) {
  std::vector<double> out;
  if (words.size() < shape.size()) return std::nullopt;
  std::size_t at = 0;
  for (const std::size_t length : shape) {
    const TextValue& word = words[at++];
    if (length == 0) {
      if (!word.is_number()) return std::nullopt;
      out.push_back(word.number());
      continue;
    }
    if (word.list() == nullptr || word.list()->size() != length) return std::nullopt;
    for (const TextValue& value : *word.list()) {
      if (!value.is_number()) return std::nullopt;
      out.push_back(value.number());
    }
  }
  return out;
}

Error strange() { return {ErrorCode::kFailed, "the far side's state is not understood"}; }

class AskedCartesian final : public ICartesianControl {
 public:
  explicit AskedCartesian(AskLine ask) : ask_(std::move(ask)) {}

  Result<CartesianState> state() const override {
    const Result<Values> words = answered(ask_, "get state");
    if (!words) return words.error();
    const auto n = flat(*words, {0, 0, 7, 0, 0});
    if (!n) return strange();
    const Result<CartesianGoal> pose = goal_from(std::span(*n).subspan(2, 7));
    if (!pose) return strange();
    return CartesianState{std::llround((*n)[0] * 1e9), pose->X_RootPalm, (*n)[1] != 0, (*n)[9],
                          (*n)[10] * kDegree_rad};
  }
  Result<CartesianPlan> plan(const CartesianGoal& goal) const override {
    if (Status valid = check(goal); !valid) return valid.error();
    const Result<Values> words = answered(ask_, "plan " + goal_words(goal));
    if (!words) return words.error();
    if (words->size() < 3 || words->front().list() == nullptr) return strange();
    const auto n = flat(*words, {words->front().list()->size(), 0, 0});
    if (!n) return strange();
    CartesianPlan plan;
    for (std::size_t i = 0; i + 2 < n->size(); ++i) plan.joints_rad.push_back((*n)[i] * kDegree_rad);
    plan.position_error_m = (*n)[n->size() - 2];
    plan.turn_error_rad = n->back() * kDegree_rad;
    return plan;
  }
  Status go_to(const CartesianGoal& goal) override {
    if (Status valid = check(goal); !valid) return valid;
    return ordered(ask_, fmt::format("go {} in {}", goal_words(goal), format_number(goal.duration_s)));
  }
  Status stop() override { return ordered(ask_, "stop"); }

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
    const auto n = flat(*words, {0, 0, 3, 0, 3, 3, 6, 7, 7});
    if (!n) return strange();
    GazeState state{std::llround((*n)[0] * 1e9), {(*n)[2], (*n)[3], (*n)[4]}, (*n)[1] != 0, (*n)[5]};
    for (Eigen::Index i = 0; i < 6; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (i < 3) state.angles_rad[i] = (*n)[6 + at] * kDegree_rad;
      if (i < 3) state.torso_rad[i] = (*n)[9 + at] * kDegree_rad;
      state.head_rad[i] = (*n)[12 + at] * kDegree_rad;
    }
    for (std::size_t eye = 0; eye < 2; ++eye) {
      const Result<CartesianGoal> pose = goal_from(std::span(*n).subspan(18 + 7 * eye, 7));
      if (!pose) return strange();
      state.X_RootEyes[eye] = pose->X_RootPalm;
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

 private:
  AskLine ask_;
};

// angles in degrees
template <class Angles>
std::string degrees(const Angles& angles_rad) {
  const Angles angles_deg = angles_rad / kDegree_rad;
  return list({angles_deg.data(), static_cast<std::size_t>(angles_deg.size())});
}

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
    return fmt::format("[is] state {} {} {} {} {} [ok]",
                       format_number(static_cast<double>(state->stamp_ns) * 1e-9), state->moving ? 1 : 0,
                       list(pose_numbers(state->X_RootPalm)), format_number(state->position_error_m),
                       format_number(state->turn_error_rad / kDegree_rad));
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
    std::vector<double> degrees;
    for (const double joint_rad : plan->joints_rad) degrees.push_back(joint_rad / kDegree_rad);
    return fmt::format("[is] plan {} {} {} [ok]", list(degrees), format_number(plan->position_error_m),
                       format_number(plan->turn_error_rad / kDegree_rad));
  }
  return fail(
      "go X Y Z [QX QY QZ QW] [in SECONDS], plan X Y Z [QX QY QZ QW], get state and stop are understood");
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
    return fmt::format("[is] state {} {} {} {} {} {} {} {} {} [ok]",
                       format_number(static_cast<double>(state->stamp_ns) * 1e-9), state->moving ? 1 : 0,
                       list({state->p_RootFixation_m.data(), 3}), format_number(state->error_px),
                       degrees(state->angles_rad), degrees(state->torso_rad), degrees(state->head_rad),
                       list(pose_numbers(state->X_RootEyes[0])), list(pose_numbers(state->X_RootEyes[1])));
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
      "AZIMUTH "
      "ELEVATION VERGENCE, get state and stop are understood");
}

std::unique_ptr<ICartesianControl> asked_cartesian(AskLine ask) {
  return std::make_unique<AskedCartesian>(std::move(ask));
}
std::unique_ptr<IGazeControl> asked_gaze(AskLine ask) { return std::make_unique<AskedGaze>(std::move(ask)); }

}  // namespace nido
