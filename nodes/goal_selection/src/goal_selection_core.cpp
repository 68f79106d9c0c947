#include "nido/goal_selection/goal_selection_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace nido {

namespace {

constexpr double kMiddle_m = 0.02;  // so near to the middle either hand will do

constexpr std::size_t kViewsKept = 30;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

Result<GoalSelectionCore> GoalSelectionCore::create(const PhraseBook& book, GoalNetwork network,
                                                    const GoalSelectionSettings& settings) {
  const auto refuse = [](const std::string& sentence) {
    return Error{ErrorCode::kInvalidArgument, sentence};
  };
  if (settings.side != "right" && settings.side != "left" && settings.side != "nearer") {
    return refuse(fmt::format("side is '{}'; allowed are right, left and nearer", settings.side));
  }
  if (settings.tries < 1) {
    return refuse(fmt::format("tries is {}; at least one is needed", settings.tries));
  }
  if (settings.percepts_for_position < 1 || settings.percepts_for_position > kViewsKept) {
    return refuse(fmt::format("percepts_for_position is {}; allowed are 1 to {}",
                              settings.percepts_for_position, kViewsKept));
  }
  for (const auto& [name, value] : {std::pair{"view_memory_s", settings.view_memory_s},
                                    {"fixation_wait_s", settings.fixation_wait_s},
                                    {"search_limit_s", settings.search_limit_s},
                                    {"reach_limit_s", settings.reach_limit_s},
                                    {"grasp_limit_s", settings.grasp_limit_s},
                                    {"job_limit_s", settings.job_limit_s},
                                    {"lost_touch_s", settings.lost_touch_s},
                                    {"lift_height_m", settings.lift_height_m},
                                    {"rest_tolerance_m", settings.rest_tolerance_m},
                                    {"release_height_m", settings.release_height_m},
                                    {"hold_s", settings.hold_s},
                                    {"check_s", settings.check_s},
                                    {"drop_check_s", settings.drop_check_s}}) {
    if (!(value > 0.0) || !std::isfinite(value)) {
      return refuse(fmt::format("{} is {}; it must be above 0", name, value));
    }
  }
  return GoalSelectionCore(book, std::move(network), settings);
}

GoalSelectionCore::GoalSelectionCore(const PhraseBook& book, GoalNetwork network,
                                     const GoalSelectionSettings& settings)
    : book_(book),
      learned_(book.objects.size()),
      network_(std::move(network)),
      settings_(settings),
      side_(picks_hand() ? "right" : settings.side) {}

GoalSelectionOutputs GoalSelectionCore::step(double now_s, const GoalSelectionInputs& inputs) {
  out_ = {};
  now_s_ = std::max(now_s_, now_s);
  if (!started_) {
    started_ = true;
    look("hand", side_);
    enter(State::kListen, "listening");
    say("idle", "begin", fmt::format("I watch my {} hand and listen.", side_));
  }
  take_in(inputs);
  for (const PhraseHeard& heard : inputs.heard) {
    hear(heard);
  }
  if (state_ == State::kListen && !waiting_.empty()) {
    const std::size_t next = waiting_.front();
    waiting_.pop_front();
    begin(next);
    say("heard", "done", fmt::format("Now \"{}\", as I heard before.", book_.phrases[next].text));
  }
  if (state_ != State::kListen) {
    if (now_s_ - job_started_s_ > settings_.job_limit_s) {
      finish(false, fmt::format("I give up: this took more than {:.0f} s.", settings_.job_limit_s));
    } else {
      advance();
    }
  }
  return std::exchange(out_, {});
}

void GoalSelectionCore::take_in(const GoalSelectionInputs& inputs) {
  if (inputs.objects) {
    // of several things with one name only the surest counts
    std::map<std::string, const SeenObject*> surest;
    for (const SeenObject& object : *inputs.objects) {
      if (object.confidence < settings_.lowest_percept_confidence || !object.p_RootObject_m.allFinite())
        continue;
      const SeenObject*& best = surest[object.name];
      if (best == nullptr || object.confidence > best->confidence) best = &object;
    }
    for (const auto& [name, object] : surest) {
      Views& views = views_[name];
      views.emplace_back(now_s_, *object);
      if (views.size() > kViewsKept) views.pop_front();
    }
  }
  if (inputs.gaze) gaze_ = *inputs.gaze;
  const auto& touch_on = picks_hand() && side_ == "left" ? inputs.left_touch_on : inputs.touch_on;
  if (touch_on && std::find(touch_on->begin(), touch_on->end(), true) != touch_on->end())
    last_touch_s_ = now_s_;

  // how the asked actions stand; answers to older questions do not count
  const auto follow = [this](Asked& asked, const std::vector<ActionState>& states, const char* who,
                             double limit_s) {
    for (const ActionState& state : states) {
      if (asked.id == 0 || state.id != asked.id) continue;
      if (&asked == &reach_) reach_error_m_ = state.error_m;
      if (state.state == "done") {
        asked.progress = Progress::kDone;
      } else if (state.state == "failed") {
        asked.progress = Progress::kFailed;
        asked.reason = state.reason.empty()
                           ? fmt::format("{} failed at {} and does not say why", who, asked.action)
                           : state.reason;
      }
    }
    if (asked.progress == Progress::kRunning && now_s_ > asked.deadline_s) {
      asked.progress = Progress::kFailed;
      asked.reason = fmt::format("{} did not finish {} within {:.0f} s", who, asked.action, limit_s);
    }
  };
  follow(reach_, inputs.reach, "reach", settings_.reach_limit_s);
  follow(grasp_, inputs.grasp, "grasp", settings_.grasp_limit_s);
}

void GoalSelectionCore::hear(const PhraseHeard& heard) {
  if (heard.accepted && book_.interrupts(heard.text)) return interrupt(heard.text);
  if (heard.accepted && heard.text.starts_with(kCorrection)) return;  // said to the hand
  if (heard.accepted) {
    if (const auto lesson = lesson_listener_.hear(heard.text, book_)) to_learn_[lesson->name] = lesson->verb;
  }
  if (heard.accepted && heard.text.starts_with(kNaming)) {  // said to the eyes
    book_.names.push_back(heard.text.substr(std::string_view(kNaming).size()));
    return;
  }
  const bool busy = state_ != State::kListen;
  const auto known = heard.accepted ? phrase_of(heard.text) : std::nullopt;
  if (busy && known && waiting_.size() < kMostWaiting) {
    waiting_.push_back(*known);
    say("heard", "begin",
        fmt::format("I heard \"{}\" and do that when I am done with {}.", heard.text, doing_));
    return;
  }
  if (busy) {
    say("heard", "failed",
        fmt::format("I heard {} but I am busy {}: say it again later.",
                    known ? "\"" + heard.text + "\"" : "somebody speak", doing_));
    return;
  }
  if (!known) {
    const std::string reason =
        !heard.reason.empty() ? heard.reason : fmt::format("no such phrase: \"{}\"", heard.text);
    say("heard", "failed", fmt::format("I did not understand: {}.", reason));
    finish(false, fmt::format("I stay idle: {}.", reason));
    return;
  }
  begin(*known);
  say("heard", "done", fmt::format("I heard \"{}\" (confidence {:.2f}).", heard.text, heard.confidence));
}

std::optional<std::size_t> GoalSelectionCore::phrase_of(const std::string& text) {
  if (const auto known = book_.find(text)) return known;
  auto order = book_.order_in(text);
  // a name that was given before the robot was switched on
  if (!order && views_.contains(text)) order = Order{text, Verb::kLook, text};
  if (!order) return std::nullopt;
  return book_.take_order(*order);
}

GoalNetwork::Choice GoalSelectionCore::choose(const SeenObject& seen) const {
  VisionParameters vision{seen.p_RootObject_m, seen.size_m.y(), seen.size_m.z(), seen.colour, seen.shape};
  const Phrase& said = book_.phrases[phrase_];
  if (said.verb == Verb::kLook) {
    if (const auto taught = network_.choose_by_name(vision, object_name())) return *taught;
  }
  if (said.object_index < learned_) return network_.choose(vision, phrase_);
  std::optional<std::size_t> like;
  for (const std::string& shape : {seen.shape, std::string("ball")}) {
    for (std::size_t i = 0; i < book_.phrases.size() && !like; ++i) {
      const Phrase& phrase = book_.phrases[i];
      if (phrase.object_index < learned_ && phrase.verb == said.verb &&
          book_.object_of(phrase).shape == shape)
        like = i;
    }
  }
  if (!like) return network_.choose(vision, std::nullopt);
  vision.colour = book_.object_of(book_.phrases[*like]).colour;
  vision.shape = book_.object_of(book_.phrases[*like]).shape;
  return network_.choose(vision, like);
}

void GoalSelectionCore::learn(const SeenObject& seen) {
  const auto lesson = to_learn_.find(object_name());
  if (lesson == to_learn_.end() || book_.phrases[phrase_].verb != lesson->second) return;
  const Action action = action_of(lesson->second);
  to_learn_.erase(lesson);
  const Status learned =
      network_.teach({object_name(),
                      action,
                      {seen.p_RootObject_m, seen.size_m.y(), seen.size_m.z(), seen.colour, seen.shape}});
  out_.taught = learned.ok();
  say("taught", learned ? "done" : "failed",
      learned
          ? fmt::format("I {} the {} from now on when I hear its name.", action_name(action), object_name())
          : fmt::format("I did not learn what to do with the {}: {}.", object_name(),
                        learned.error().message));
}

void GoalSelectionCore::begin(std::size_t phrase) {
  phrase_ = phrase;
  chosen_ = false;
  try_number_ = 1;
  only_side_.clear();
  job_started_s_ = now_s_;
  enter(State::kFind, "looking for the " + object_name());
}

std::string GoalSelectionCore::in_hand() const {
  return now_s_ - last_touch_s_ <= settings_.lost_touch_s ? held_ : "";
}

void GoalSelectionCore::interrupt(const std::string& text) {
  waiting_.clear();
  const bool busy = state_ != State::kListen;
  // the arm may be on its way home though no job is left
  ask_reach("stop", target_.p_RootObject_m);
  // fingers that hold something must go on pressing
  const bool closed = grasp_.action == "grasp" && grasp_.progress == Progress::kDone;
  if (!closed) ask_grasp("stop");
  if (busy && closed && state_ != State::kRelease && held_.empty() && was_felt_) held_ = object_name();
  const std::string kept = in_hand();
  const std::string keeps = kept.empty() ? "" : fmt::format(" I keep the {} in my hand.", kept);
  if (!busy) {
    say("heard", "begin", fmt::format("I heard \"{}\" and do not move.{}", text, keeps));
    return;
  }
  say("heard", "begin", fmt::format("I heard \"{}\".", text));
  finish(false, fmt::format("I stop {}, as I was told.{}", doing_, keeps));
}

void GoalSelectionCore::enter(State state, const std::string& doing) {
  state_ = state;
  entered_s_ = now_s_;
  doing_ = doing;
}

void GoalSelectionCore::look(const std::string& mode, const std::string& target) {
  if (looking_.mode == mode && looking_.target == target) return;
  looking_ = {mode, target};
  gaze_ = {};  // what the head reported was about something else
  out_.gaze.push_back(looking_);
}

void GoalSelectionCore::ask_reach(const std::string& action, const Eigen::Vector3d& p_RootTarget_m) {
  reach_ = {next_id_++, action, now_s_ + settings_.reach_limit_s, Progress::kRunning, ""};
  hand_away_ = action != "home";
  out_.reach.push_back(
      {reach_.id, action, name_and_shape(), p_RootTarget_m, target_.size_m, target_.yaw_rad, side_});
}

std::string GoalSelectionCore::name_and_shape() const {
  const bool taught = book_.phrases[phrase_].object_index >= learned_;
  return taught ? object_name() + " " + target_.shape : object_name();
}

std::string GoalSelectionCore::hand_for_job() const {
  if (!picks_hand() || !in_hand().empty()) return side_;
  if (!only_side_.empty()) return only_side_;
  // what is to be dropped is taken by the hand that is nearer to its whole way
  double y_Root_m = target_.p_RootObject_m.y();
  const auto basket = views_.find(settings_.basket);
  if (action_ == Action::kDrop && basket != views_.end())
    y_Root_m = 0.5 * (y_Root_m + basket->second.back().second.p_RootObject_m.y());
  if (std::abs(y_Root_m) < kMiddle_m) return side_;
  return y_Root_m > 0.0 ? "right" : "left";
}

std::string GoalSelectionCore::hand_text() const { return picks_hand() ? side_ + " hand" : "hand"; }

void GoalSelectionCore::ask_grasp(const std::string& action) {
  if (action == "open" || action == "release") held_.clear();
  grasp_ = {next_id_++, action, now_s_ + settings_.grasp_limit_s, Progress::kRunning, ""};
  out_.grasp.push_back(
      {grasp_.id, action, name_and_shape(), target_.p_RootObject_m, target_.size_m, target_.yaw_rad, side_});
}

void GoalSelectionCore::say(const std::string& stage, const std::string& state, const std::string& text) {
  const bool about_object = state_ != State::kListen;
  out_.stages.push_back({stage, state, about_object ? object_name() : "", text});
}

void GoalSelectionCore::finish(bool success, const std::string& text) {
  say("idle", success ? "done" : "failed", text);
  enter(State::kListen, "listening");
}

void GoalSelectionCore::stage_failed(const std::string& stage, const std::string& sentence,
                                     bool worth_another_try) {
  const bool again = worth_another_try && try_number_ < settings_.tries;
  if (again) {
    ++try_number_;
    say(stage, "failed", fmt::format("{} I try again ({} of {}).", sentence, try_number_, settings_.tries));
  } else {
    say(stage, "failed", sentence);
  }
  // the hand away from the table, so that nothing is hidden and nothing is swept down
  if (action_ == Action::kGrasp || action_ == Action::kDrop) ask_grasp("open");
  ask_reach("home", target_.p_RootObject_m);
  if (again) {
    look("object", object_name());
    enter(State::kBackOff, "taking my hand back");
  } else {
    finish(false, sentence);
  }
}

const std::string& GoalSelectionCore::object_name() const {
  return book_.object_of(book_.phrases[phrase_]).name;
}

std::optional<SeenObject> GoalSelectionCore::view_of(const std::string& name, std::size_t count,
                                                     double since_s) const {
  const auto found = views_.find(name);
  if (found == views_.end()) return std::nullopt;
  const double oldest_s = std::max(since_s, now_s_ - settings_.view_memory_s);
  std::vector<const SeenObject*> views;
  for (const auto& [time_s, view] : found->second) {
    if (time_s >= oldest_s) views.push_back(&view);
  }
  if (views.size() < std::max<std::size_t>(1, count)) return std::nullopt;

  SeenObject result = *views.back();
  const auto median_of = [&](auto&& get) {
    std::vector<double> values;
    for (const SeenObject* view : views) values.push_back(get(*view));
    return median(std::move(values));
  };
  for (Eigen::Index i = 0; i < 3; ++i) {
    result.p_RootObject_m[i] = median_of([i](const SeenObject& view) { return view.p_RootObject_m[i]; });
    result.size_m[i] = median_of([i](const SeenObject& view) { return view.size_m[i]; });
  }
  // a cube looks the same after a quarter turn: mean direction of four times the angle
  double sine = 0.0;
  double cosine = 0.0;
  for (const SeenObject* view : views) {
    sine += std::sin(4.0 * view->yaw_rad);
    cosine += std::cos(4.0 * view->yaw_rad);
  }
  result.yaw_rad = std::atan2(sine, cosine) / 4.0;
  return result;
}

}  // namespace nido
