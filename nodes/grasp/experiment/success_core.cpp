#include "success_core.h"

#include <random>
#include <utility>

namespace nido::grasp {

namespace {

constexpr double kSettle_s = 1.0;  // what was put down comes to rest, and the eyes have seen it
// The table stays empty for so long: the eyes keep a thing's identity for 3 s, and would take the next thing
// for the last one, moved.
constexpr double kEmpty_s = 4.0;
constexpr double kPi = 3.14159265358979323846;

}  // namespace

const std::vector<double>& unseen_boxes_m() {
  static const std::vector<double> edges = {0.025, 0.03, 0.035, 0.04, 0.045, 0.055, 0.06};
  return edges;
}

const std::vector<std::array<double, 2>>& unseen_cylinders_m() {
  static const std::vector<std::array<double, 2>> tins = {
      {0.03, 0.05}, {0.04, 0.06}, {0.048, 0.06}, {0.05, 0.08}, {0.06, 0.05}};
  return tins;
}

SuccessThing draw_thing(std::uint64_t seed, int number, const std::string& hand) {
  std::seed_seq mix{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                    static_cast<std::uint32_t>(number)};
  std::mt19937_64 random(mix);
  const auto draw = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  SuccessThing thing;
  thing.p_Root_m.x() = draw(-0.38, -0.26);
  thing.p_Root_m.y() = draw(0.0, 0.12);
  thing.yaw_rad = draw(-kPi, kPi);
  if (hand == "left") {
    thing.p_Root_m.y() *= -1.0;
    thing.yaw_rad *= -1.0;
  }
  const auto one_of = [&](const auto& list) {
    return list[std::uniform_int_distribution<std::size_t>(0, list.size() - 1)(random)];
  };
  const double edge_m = one_of(unseen_boxes_m());
  const std::array<double, 2> tin_m = one_of(unseen_cylinders_m());
  switch (number % 5) {
    case 0:
      thing.shape = "box";
      thing.trained = true;
      thing.width_m = thing.height_m = 0.05;
      thing.phrases = {"grasp blue cube"};
      break;
    case 1:
      thing.shape = "ball";
      thing.trained = true;
      thing.width_m = thing.height_m = 0.06;
      thing.phrases = {"grasp blue ball"};
      break;
    case 2:
      thing.shape = "box";
      thing.width_m = thing.height_m = edge_m;
      thing.phrases = {"grasp blue cube", "grasp blue ball"};
      break;
    case 3:
      thing.shape = "cylinder";
      thing.width_m = tin_m[0];
      thing.height_m = tin_m[1];
      thing.phrases = {"grasp blue ball", "grasp blue cube"};
      break;
    default:
      thing.shape = "bear";
      thing.phrases = {"grasp teddy bear"};
      break;
  }
  return thing;
}

void SuccessCore::clear(SuccessOutputs& out) {
  state_ = State::kClear;
  in_state_s_ = 0;
  watching_ = false;
  open_ = false;
  home_ = false;
  ++id_;
  out.remove = true;
  out.grasp = SuccessOutputs::Action{id_, "release"};
  out.reach = SuccessOutputs::Action{id_, "home"};
}

void SuccessCore::tell(SuccessOutputs& out) {
  state_ = State::kJob;
  in_state_s_ = 0;
  out.say = result_.thing.phrases[phrase_];
}

void SuccessCore::follow_job(double dt_s, const SuccessInputs& inputs, SuccessOutputs& out) {
  if (watching_) {
    since_look_s_ += dt_s;
    if (inputs.above_rest_m) {
      const double since_s = std::exchange(since_look_s_, 0.0);
      // once down is down: the test is one hold without a break
      if (*inputs.above_rest_m < options_.up_m) {
        watching_ = false;
      } else {
        result_.held_s += since_s;
      }
    }
  }
  bool ended = in_state_s_ > options_.job_limit_s;
  bool not_found = false;
  for (const SuccessInputs::Stage& line : inputs.stages) {
    if (line.stage == "seen" && line.state == "failed") not_found = true;
    if (line.stage == "grasped" && line.state == "begin") {
      ++result_.closings;
      watching_ = false;
    }
    if (line.stage == "grasped" && line.state == "failed") {
      if (line.text.find("lost") != std::string::npos) ++result_.slips_noticed;
    }
    if (line.stage == "grasped" && line.state == "done") {
      watching_ = true;
      since_look_s_ = 0;
      result_.held_s = 0;
    }
    if (line.stage == "idle") {
      ended = true;
      result_.said_so = line.state == "done";
      result_.sentence = line.text;
    }
  }
  if (!ended) return;
  if (not_found && result_.closings == 0 && phrase_ + 1 < result_.thing.phrases.size()) {
    ++phrase_;
    tell(out);
    return;
  }
  constexpr double kRounding_s = 1e-6;
  result_.success = result_.held_s >= options_.test_s - kRounding_s;
  out.result = result_;
  clear(out);
}

SuccessOutputs SuccessCore::step(double dt_s, const SuccessInputs& inputs) {
  SuccessOutputs out;
  in_state_s_ += dt_s;
  if (!begun_) {
    begun_ = true;
    clear(out);
    return out;
  }
  switch (state_) {
    case State::kClear: {
      open_ = open_ || (inputs.grasp && inputs.grasp->id == id_ && inputs.grasp->ended);
      home_ = home_ || (inputs.reach && inputs.reach->id == id_ && inputs.reach->ended);
      if (!(open_ && home_) && in_state_s_ < options_.clear_limit_s) break;
      if (number_ >= options_.first + options_.count) {
        state_ = State::kFinished;
        out.finished = true;
        break;
      }
      if (in_state_s_ < kEmpty_s) break;
      result_ = SuccessResult{};
      result_.number = number_;
      result_.thing = draw_thing(options_.seed, number_, options_.hand);
      ++number_;
      phrase_ = 0;
      out.put = result_.thing;
      state_ = State::kSettle;
      in_state_s_ = 0;
      break;
    }
    case State::kSettle:
      if (in_state_s_ >= kSettle_s) tell(out);
      break;
    case State::kJob:
      follow_job(dt_s, inputs, out);
      break;
    case State::kFinished:
      break;
  }
  return out;
}

}  // namespace nido::grasp
