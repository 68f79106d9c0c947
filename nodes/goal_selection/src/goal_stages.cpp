// the steps of a job, one function a state
#include <fmt/format.h>

#include <cmath>

#include "nido/goal_selection/goal_selection_core.h"

namespace nido {

namespace {

constexpr double kMostUncertainHold_s = 3.0;  // a fixation that ended this long ago is taken up again
constexpr double kLiftSeen_m = 0.04;          // an object seen this much higher was lifted
constexpr double kBasketMargin_m = 0.03;  // an object seen this far outside the walls may still lean on them
constexpr double kBasketHalf_m = 0.09;    // of a basket whose size was not seen

std::string place_text(const SeenObject& object) {
  const Eigen::Vector3d& p = object.p_RootObject_m;
  return fmt::format("{:.0f} cm in front of me, {:.0f} cm to the {}", -100.0 * p.x(), 100.0 * std::abs(p.y()),
                     p.y() >= 0.0 ? "right" : "left");
}

// a reason as the end of a sentence of our own
std::string clause(std::string reason) {
  while (!reason.empty() && (reason.back() == '.' || reason.back() == ' ')) reason.pop_back();
  return reason;
}

// reach says so in its sentence
bool says_out_of_reach(const std::string& reason) { return reason.find("out of reach") != std::string::npos; }

}  // namespace

void GoalSelectionCore::advance() {
  switch (state_) {
    case State::kListen:
      break;
    case State::kFind:
      return step_find();
    case State::kFixate:
      return step_fixate();
    case State::kChangeHands:
      return step_change_hands();
    case State::kReach:
      return step_reach();
    case State::kPregrasp:
      return step_pregrasp();
    case State::kClose:
      return step_close();
    case State::kLift:
      return step_lift();
    case State::kCheckLift:
      return step_check_lift();
    case State::kHold:
      return step_hold();
    case State::kFindBasket:
      return step_find_basket();
    case State::kFixateBasket:
      return step_fixate_basket();
    case State::kCarry:
      return step_carry();
    case State::kRelease:
      return step_release();
    case State::kGoHome:
      return step_go_home();
    case State::kCheckDrop:
      return step_check_drop();
    case State::kBackOff:
      return step_back_off();
  }
}

bool GoalSelectionCore::found(const std::string& name, const std::string& stage, const std::string& missing) {
  if (view_of(name, 1, entered_s_)) return true;
  look("search", name);
  const bool whole_scan = gaze_.mode == "search" && gaze_.target == name && gaze_.search_done;
  if (whole_scan || in_state_s() > settings_.search_limit_s) {
    say(stage, "failed", missing);
    finish(false, missing);
  }
  return false;
}

bool GoalSelectionCore::measured(const std::string& name, SeenObject& result) {
  look("object", name);
  const bool centred = gaze_.mode == "object" && gaze_.target == name && gaze_.fixated;
  if (!centred && in_state_s() < settings_.fixation_wait_s) return false;
  const auto view = view_of(name, settings_.percepts_for_position, entered_s_);
  if (!view) return false;
  result = *view;
  return true;
}

void GoalSelectionCore::reach_failed(const std::string& stage, const std::string& what) {
  const std::string sentence = fmt::format("{}: {}.", what, clause(reach_.reason));
  if (!says_out_of_reach(reach_.reason)) return stage_failed(stage, sentence);
  // trying the same place again is of no use
  const bool other_hand = picks_hand() && only_side_.empty();
  if (other_hand) only_side_ = side_ == "right" ? "left" : "right";
  stage_failed(stage, sentence, other_hand);
}

void GoalSelectionCore::step_find() {
  if (!found(object_name(), "seen",
             fmt::format("I looked over the whole table and do not find the {}.", object_name()))) {
    return;
  }
  if (!chosen_) {
    const SeenObject seen = *view_of(object_name(), 1, entered_s_);
    learn(seen);
    const GoalNetwork::Choice choice = choose(seen);
    action_ = choice.action;
    chosen_ = true;
    say("chosen", "done",
        fmt::format("I choose to {} (idle {:.2f}, reach {:.2f}, grasp {:.2f}, drop {:.2f}).",
                    action_ == Action::kIdle ? "stay idle" : action_name(action_), choice.activation[0],
                    choice.activation[1], choice.activation[2], choice.activation[3]));
  }
  enter(State::kFixate, "looking at the " + object_name());
}

void GoalSelectionCore::step_fixate() {
  if (!measured(object_name(), target_)) {
    // it may have been a glimpse of something else
    if (in_state_s() > settings_.fixation_wait_s + kMostUncertainHold_s) {
      stage_failed("seen", fmt::format("I saw the {} but lost it from sight.", object_name()));
    }
    return;
  }
  if (change_hands()) return;
  say("seen", "done", fmt::format("I see the {} {}.", object_name(), place_text(target_)));
  switch (action_) {
    case Action::kIdle:
      finish(true,
             book_.phrases[phrase_].verb == Verb::kLook
                 ? fmt::format("I look at the {}; nobody told me what to do with it.", object_name())
                 : fmt::format("I look at the {} and stay idle: that is what I learned.", object_name()));
      break;
    case Action::kReach:
      ask_reach("reach", target_.p_RootObject_m);
      say("reached", "begin",
          fmt::format("I reach for the {}{}.", object_name(), picks_hand() ? " with my " + hand_text() : ""));
      enter(State::kReach, "reaching for the " + object_name());
      break;
    case Action::kGrasp:
    case Action::kDrop:
      if (in_hand() == object_name()) {
        // an earlier job ended with it in the hand
        was_felt_ = true;
        say("grasped", "done", fmt::format("I hold the {} already.", object_name()));
        if (action_ == Action::kGrasp) {
          enter(State::kHold, "holding the " + object_name());
        } else {
          enter(State::kFindBasket, "looking for the basket");
        }
        break;
      }
      ask_grasp("open");
      ask_reach("pregrasp", target_.p_RootObject_m);
      say("reached", "begin", fmt::format("I open my {} and reach for the {}.", hand_text(), object_name()));
      enter(State::kPregrasp, "reaching for the " + object_name());
      break;
  }
}

bool GoalSelectionCore::change_hands() {
  if (action_ == Action::kIdle) return false;
  const std::string side = hand_for_job();
  if (side == side_) return false;
  if (hand_away_) ask_reach("home", target_.p_RootObject_m);
  if (reach_.progress != Progress::kRunning) {
    side_ = side;
    return false;
  }
  enter(State::kChangeHands, fmt::format("taking my {} back", hand_text()));
  return true;
}

void GoalSelectionCore::step_change_hands() {
  if (reach_.progress == Progress::kRunning) return;
  if (reach_.progress == Progress::kFailed) {
    stage_failed("reached",
                 fmt::format("I could not take my {} back: {}.", hand_text(), clause(reach_.reason)));
    return;
  }
  side_ = hand_for_job();
  // things are looked at again, now that nothing hides them
  enter(State::kFixate, "looking at the " + object_name());
}

void GoalSelectionCore::step_reach() {
  if (reach_.progress == Progress::kFailed) {
    reach_failed("reached", fmt::format("I could not reach the {}", object_name()));
  } else if (reach_.progress == Progress::kDone) {
    say("reached", "done",
        fmt::format("My hand is at the {}, {:.0f} mm from where I wanted it.", object_name(),
                    1000.0 * reach_error_m_));
    finish(true, fmt::format("Done: I reached the {}.", object_name()));
  }
}

void GoalSelectionCore::step_pregrasp() {
  if (reach_.progress == Progress::kFailed) {
    reach_failed("reached", fmt::format("I could not reach the {}", object_name()));
  } else if (grasp_.progress == Progress::kFailed) {
    stage_failed("reached", fmt::format("I could not open my hand: {}.", clause(grasp_.reason)));
  } else if (reach_.progress == Progress::kDone && grasp_.progress == Progress::kDone) {
    say("reached", "done", fmt::format("My open hand is at the {}.", object_name()));
    was_felt_ = false;
    ask_grasp("grasp");
    say("grasped", "begin", fmt::format("I close my fingers round the {}.", object_name()));
    enter(State::kClose, "grasping the " + object_name());
  }
}

void GoalSelectionCore::step_close() {
  if (grasp_.progress == Progress::kFailed) {
    stage_failed("grasped",
                 fmt::format("I did not get hold of the {}: {}.", object_name(), clause(grasp_.reason)));
  } else if (grasp_.progress == Progress::kDone) {
    was_felt_ = last_touch_s_ >= entered_s_;
    ask_reach("lift", target_.p_RootObject_m + Eigen::Vector3d(0, 0, settings_.lift_height_m));
    enter(State::kLift, "lifting the " + object_name());
  }
}

bool GoalSelectionCore::lost_it(const std::string& stage) {
  std::string how;
  if (grasp_.progress == Progress::kFailed) {
    how = clause(grasp_.reason);
  } else if (was_felt_ && now_s_ - last_touch_s_ > settings_.lost_touch_s) {
    how = fmt::format("my fingers have felt nothing for {:.1f} s", settings_.lost_touch_s);
  } else {
    return false;
  }
  stage_failed(stage, fmt::format("I lost the {}: {}.", object_name(), how));
  return true;
}

void GoalSelectionCore::step_lift() {
  if (lost_it("grasped")) return;
  if (reach_.progress == Progress::kFailed) {
    stage_failed("grasped",
                 fmt::format("I could not lift the {}: {}.", object_name(), clause(reach_.reason)));
  } else if (reach_.progress == Progress::kDone) {
    enter(State::kCheckLift, "checking what I hold");
  }
}

void GoalSelectionCore::step_check_lift() {
  if (lost_it("grasped")) return;
  // sight has the last word: touch cannot tell the object from the table
  const auto view = view_of(object_name(), settings_.percepts_for_position, entered_s_);
  const bool seen_lifted = view && view->p_RootObject_m.z() > target_.p_RootObject_m.z() + kLiftSeen_m;
  const bool seen_at_rest =
      view && (view->p_RootObject_m - target_.p_RootObject_m).norm() < settings_.rest_tolerance_m;
  if (seen_at_rest) {
    stage_failed("grasped",
                 fmt::format("My hand came up without the {}: I see it still on the table.", object_name()));
    return;
  }
  if (!seen_lifted && in_state_s() < settings_.check_s) return;
  say("grasped", "done",
      fmt::format("I hold the {}: {}.", object_name(),
                  seen_lifted ? "I see it in my hand, off the table" : "it is no longer where it stood"));
  held_ = object_name();
  if (action_ == Action::kGrasp) {
    enter(State::kHold, "holding the " + object_name());
  } else {
    enter(State::kFindBasket, "looking for the basket");
  }
}

void GoalSelectionCore::step_hold() {
  if (lost_it("grasped")) return;
  if (in_state_s() >= settings_.hold_s) {
    finish(true, fmt::format("Done: I hold the {}.", object_name()));
  }
}

void GoalSelectionCore::step_find_basket() {
  if (lost_it("carried")) return;
  // hand and object may hide it now; then it is where it was seen last
  const auto earlier = views_.find(settings_.basket);
  if (gaze_.mode == "search" && gaze_.target == settings_.basket && gaze_.search_done &&
      earlier != views_.end() && !view_of(settings_.basket, 1, entered_s_)) {
    basket_ = earlier->second.back().second;
    carry_to_basket();
    return;
  }
  if (found(settings_.basket, "carried",
            fmt::format("I hold the {} but looked over the whole table and do not find the {}.",
                        object_name(), settings_.basket))) {
    enter(State::kFixateBasket, "looking at the basket");
  }
}

void GoalSelectionCore::step_fixate_basket() {
  if (lost_it("carried")) return;
  if (measured(settings_.basket, basket_)) {
    carry_to_basket();
  } else if (in_state_s() > settings_.fixation_wait_s + kMostUncertainHold_s) {
    enter(State::kFindBasket, "looking for the basket");  // bounded by the limit of the job
  }
}

void GoalSelectionCore::carry_to_basket() {
  const double rim_z_m = basket_.p_RootObject_m.z() + 0.5 * basket_.size_m.z();
  ask_reach("carry",
            {basket_.p_RootObject_m.x(), basket_.p_RootObject_m.y(), rim_z_m + settings_.release_height_m});
  say("carried", "begin",
      fmt::format("I see the {} {} and carry the {} there.", settings_.basket, place_text(basket_),
                  object_name()));
  enter(State::kCarry, "carrying the " + object_name());
}

void GoalSelectionCore::step_carry() {
  if (lost_it("carried")) return;
  if (reach_.progress == Progress::kFailed) {
    reach_failed("carried",
                 fmt::format("I could not bring the {} over the {}", object_name(), settings_.basket));
  } else if (reach_.progress == Progress::kDone) {
    say("carried", "done", fmt::format("The {} is over the {}.", object_name(), settings_.basket));
    ask_grasp("release");
    say("dropped", "begin", fmt::format("I let the {} go.", object_name()));
    enter(State::kRelease, "letting go");
  }
}

void GoalSelectionCore::step_release() {
  if (grasp_.progress == Progress::kFailed) {
    stage_failed("dropped", fmt::format("I could not open my hand: {}.", clause(grasp_.reason)));
  } else if (grasp_.progress == Progress::kDone) {
    ask_reach("home", target_.p_RootObject_m);
    enter(State::kGoHome, "taking my hand back");
  }
}

void GoalSelectionCore::step_go_home() {
  // how the hand gets home does not matter for what lies in the basket
  if (reach_.progress == Progress::kRunning) return;
  enter(State::kCheckDrop, "checking the basket");
}

void GoalSelectionCore::step_check_drop() {
  look("object", settings_.basket);
  const auto view = view_of(object_name(), settings_.percepts_for_position, entered_s_);
  if (!view) {
    if (in_state_s() > settings_.drop_check_s) {
      say("dropped", "done",
          fmt::format("I let the {} go over the {} and see it nowhere else.", object_name(),
                      settings_.basket));
      finish(true, fmt::format("Done: I dropped the {} into the {}.", object_name(), settings_.basket));
    }
    return;
  }
  const Eigen::Vector3d offset_m = view->p_RootObject_m - basket_.p_RootObject_m;
  const auto inside = [](double offset, double size) {
    return std::abs(offset) < (size > 0.0 ? 0.5 * size : kBasketHalf_m) + kBasketMargin_m;
  };
  if (inside(offset_m.x(), basket_.size_m.x()) && inside(offset_m.y(), basket_.size_m.y())) {
    say("dropped", "done", fmt::format("I see the {} in the {}.", object_name(), settings_.basket));
    finish(true, fmt::format("Done: I dropped the {} into the {}.", object_name(), settings_.basket));
  } else {
    stage_failed("dropped", fmt::format("The {} fell beside the {}: I see it {}.", object_name(),
                                        settings_.basket, place_text(*view)));
  }
}

void GoalSelectionCore::step_back_off() {
  if (reach_.progress == Progress::kRunning || grasp_.progress == Progress::kRunning) return;
  enter(State::kFind, "looking for the " + object_name());
}

}  // namespace nido
