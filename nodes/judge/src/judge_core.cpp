#include "nido/judge/judge_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace nido {

namespace {

constexpr double kLookPeriod_s = 0.1;  // between questions to the world while something is held
constexpr double kRestPeriod_s = 0.2;  // between two looks at what should be at rest

const std::vector<std::string> kStages = {"heard",   "chosen",  "seen",   "reached",
                                          "grasped", "carried", "dropped"};

// lowest point of an object's box over the table
double clear_height_m(const ObjectTruth& object, double table_z_m) {
  const Eigen::Vector3d half = 0.5 * object.size_m;
  const double reach_down = object.X_RootObject.linear().row(2).cwiseAbs().dot(half);
  return object.X_RootObject.translation().z() - reach_down - table_z_m;
}

}  // namespace

double distance_to_box(const Eigen::Vector3d& p_Root_m, const ObjectTruth& box) {
  const Eigen::Vector3d p_Box = box.X_RootObject.inverse() * p_Root_m;
  const Eigen::Vector3d outside = (p_Box.cwiseAbs() - 0.5 * box.size_m).cwiseMax(0.0);
  return outside.norm();
}

Result<JudgeCore> JudgeCore::create(const PhraseBook& book, const JudgeSettings& settings) {
  for (const auto& [name, value] : {std::pair{"limit_s", settings.limit_s},
                                    {"settle_s", settings.settle_s},
                                    {"settle_limit_s", settings.settle_limit_s},
                                    {"rest_m", settings.rest_m},
                                    {"lift_m", settings.lift_m},
                                    {"hold_s", settings.hold_s},
                                    {"reach_m", settings.reach_m},
                                    {"stop_s", settings.stop_s},
                                    {"stop_m", settings.stop_m}}) {
    if (!(value > 0.0) || !std::isfinite(value)) {
      return Error{ErrorCode::kInvalidArgument, fmt::format("{} is {}; it must be above 0", name, value)};
    }
  }
  return JudgeCore(book, settings);
}

JudgeCore::JudgeCore(const PhraseBook& book, const JudgeSettings& settings)
    : book_(book), settings_(settings) {
  for (const std::string& text : settings.lessons) {
    if (const auto lesson = book_.order_in(text)) learn(*lesson);
  }
  std::size_t phrases = 0;
  for (const auto& order : split_orders(settings.expected)) {
    // said to the hand or to the eyes, no order
    if (order.text.starts_with(kCorrection) || order.text.starts_with(kNaming)) continue;
    said_.push_back(order.text);
    phrases += book_.interrupts(order.text) ? 0 : 1;
  }
  orders_ = std::max<std::size_t>(1, phrases);
}

const std::string& JudgeCore::object_name() const { return book_.object_of(book_.phrases[*phrase_]).name; }

void JudgeCore::learn(const Order& lesson) {
  book_.phrases[book_.take_order({lesson.name, Verb::kLook, lesson.name})].verb = lesson.verb;
}

void JudgeCore::heard(const HeardSeen& heard) {
  if (heard.text.starts_with(kCorrection)) return;
  if (const auto lesson = lesson_listener_.hear(heard.text, book_)) learn(*lesson);
  if (heard.text.starts_with(kNaming)) {
    book_.names.push_back(heard.text.substr(std::string_view(kNaming).size()));
    return;
  }
  if (heard_text_.empty()) {
    heard_text_ = heard.text;
    heard_reason_ = heard.reason;
  }
  if (heard.text.empty()) return;
  heard_texts_.push_back(heard.text);
  if (book_.interrupts(heard.text)) {
    interrupted_s_ = heard.end_s;
    later_.clear();
    return;
  }
  auto phrase = book_.find(heard.text);
  if (!phrase) {
    const auto order = book_.order_in(heard.text);  // of a thing that the world calls as people do
    if (!order) return;
    phrase = book_.take_order(*order);
  }
  if (phrase_) {
    later_.push_back(*phrase);
    return;
  }
  phrase_ = phrase;
  interrupted_s_.reset();
  if (ended_ == 0) metrics_.emplace_back("speech_latency_s", Metric{heard.time_s - heard.end_s, "s"});
}

// an order that is not the last is over: what it was about is looked at when all is over
void JudgeCore::next_order() {
  if (phrase_ && !end_good_ && !interrupted_s_ && earlier_trouble_.empty()) {
    earlier_trouble_ = fmt::format("\"{}\" failed: {}", book_.phrases[*phrase_].text, end_text_);
  }
  if (phrase_ && end_good_ && book_.phrases[*phrase_].verb == Verb::kDrop) dropped_.push_back(object_name());
  phrase_.reset();
  if (!later_.empty()) {
    phrase_ = later_.front();
    later_.pop_front();
  }
  end_s_.reset();
  interrupted_s_.reset();
  last_done_.clear();
  last_failed_.clear();
  done_s_.clear();
  held_since_s_.reset();
  longest_hold_s_ = 0.0;
}

void JudgeCore::check_earlier(GroundTruth& truth) {
  if (!outcome_ || !outcome_->success) return;
  std::string trouble = earlier_trouble_;
  for (const std::string& name : dropped_) {
    const auto inside = truth.inside(name, settings_.basket);
    if (trouble.empty() && !(inside && *inside)) {
      trouble = fmt::format("The {} is not in the {}.", name, settings_.basket);
    }
  }
  if (trouble.empty()) return;
  outcome_->success = false;
  outcome_->object_in_basket = false;
  outcome_->sentence = trouble;
}

void JudgeCore::judge_stop(double now_s, GroundTruth& truth) {
  constexpr double kLook_s = 0.2;  // between two looks at a hand that must rest
  const double late_s = *end_s_ - *interrupted_s_;
  if (now_s < *interrupted_s_ + settings_.stop_s + (palms_m_.empty() ? 0.0 : kLook_s)) return;
  const auto palms = truth.X_RootPalms();
  if (!palms) {
    conclude(false, fmt::format("The world does not tell where the hand is: {}", palms.error().message));
    return;
  }
  if (palms_m_.empty()) {
    for (const Eigen::Isometry3d& palm : *palms) palms_m_.emplace_back(palm.translation());
    return;
  }
  double moved_m = 0.0;
  for (std::size_t i = 0; i < palms->size(); ++i)
    moved_m = std::max(moved_m, ((*palms)[i].translation() - palms_m_[i]).norm());
  metrics_.emplace_back("stop_latency_s", Metric{late_s, "s"});
  if (late_s > settings_.stop_s) {
    conclude(false, fmt::format("The robot stopped {:.2f} s after it was told to; {:.2f} s are allowed.",
                                late_s, settings_.stop_s));
  } else if (moved_m > settings_.stop_m) {
    conclude(false,
             fmt::format("The hand still moves {:.2f} s after it was told to stop.", settings_.stop_s));
  } else {
    conclude(true,
             fmt::format("The robot stopped {:.2f} s after it was told to, and its hand rests.", late_s));
  }
}

bool JudgeCore::stage(const StageSeen& line) {
  if (end_s_) return false;
  if (!first_s_) first_s_ = line.time_s;
  const bool final = line.stage == "idle" && line.state != "begin";
  if (final) {
    // what is said is still to come when a sound that was no phrase ends in idleness
    if (phrase_) ++ended_;
    end_s_ = line.time_s;
    end_good_ = line.state == "done";
    end_text_ = line.text;
    if (phrase_ && ended_ < orders_) {
      next_order();
      return true;
    }
    if (end_good_) done_s_.try_emplace("idle", line.time_s);
    return true;
  }
  if (line.state == "done") {
    last_done_ = line.stage;
    done_s_[line.stage] = line.time_s;
  } else if (line.state == "failed") {
    last_failed_ = line.stage;
    ++failed_tries_;
  }
  return true;
}

bool JudgeCore::tick(double now_s, GroundTruth& truth) {
  if (outcome_) return true;
  if (!first_s_) first_s_ = now_s;
  if (!end_s_) {
    if (now_s - *first_s_ > settings_.limit_s) {
      conclude(false,
               fmt::format("The run was not over after {:.0f} s of simulated time.", settings_.limit_s));
      return true;
    }
    if (last_done_ == "grasped") watch_hold(now_s, truth);
    return false;
  }

  const std::string said = fmt::format("{}", fmt::join(said_, "; "));
  const std::string heard =
      heard_texts_.empty() ? heard_text_ : fmt::format("{}", fmt::join(heard_texts_, "; "));
  if (interrupted_s_ && phrase_ && !end_good_ && (said_.empty() || said == heard)) {
    judge_stop(now_s, truth);
  } else if (!end_good_ || !phrase_) {
    conclude(false, end_text_);
  } else if (!said_.empty() && heard != said) {
    conclude(false, fmt::format("\"{}\" was said but \"{}\" was heard.", said, heard));
  } else {
    switch (book_.phrases[*phrase_].verb) {
      case Verb::kLook:
        conclude(true, end_text_);
        break;
      case Verb::kReach:
        judge_reach(truth);
        break;
      case Verb::kGrasp:
        judge_grasp(now_s, truth);
        break;
      case Verb::kDrop:
        judge_drop(now_s, truth);
        break;
    }
  }
  check_earlier(truth);
  return outcome_.has_value();
}

void JudgeCore::watch_hold(double now_s, GroundTruth& truth) {
  if (!phrase_ || book_.phrases[*phrase_].verb != Verb::kGrasp || now_s < next_look_s_) return;
  next_look_s_ = now_s + kLookPeriod_s;
  const auto object = truth.object(object_name());
  const auto holds = truth.held(object_name());
  const bool held =
      object && holds && *holds && clear_height_m(*object, settings_.table_z_m) >= settings_.lift_m;
  if (!held) {
    held_since_s_.reset();
    return;
  }
  if (!held_since_s_) held_since_s_ = now_s;
  longest_hold_s_ = std::max(longest_hold_s_, now_s - *held_since_s_);
}

void JudgeCore::judge_grasp(double now_s, GroundTruth& truth) {
  watch_hold(now_s, truth);
  // it may have begun late: give it the time as long as it holds
  const bool may_come = held_since_s_ && now_s < *end_s_ + settings_.hold_s + settings_.settle_s;
  if (longest_hold_s_ < settings_.hold_s && may_come) return;
  metrics_.emplace_back("hold_s", Metric{longest_hold_s_, "s"});
  if (longest_hold_s_ >= settings_.hold_s) {
    conclude(true, fmt::format("The {} was held for {:.1f} s, more than {:.0f} cm over the table.",
                               object_name(), longest_hold_s_, 100.0 * settings_.lift_m));
  } else {
    conclude(
        false,
        fmt::format("The robot believes that it holds the {}, but it was held over the table for {:.1f} s "
                    "only.",
                    object_name(), longest_hold_s_));
  }
}

void JudgeCore::judge_reach(GroundTruth& truth) {
  const auto object = truth.object(object_name());
  const auto palms = truth.X_RootPalms();
  if (!object || !palms) {
    conclude(false, fmt::format("The world does not tell where hand and {} are: {}", object_name(),
                                object ? palms.error().message : object.error().message));
    return;
  }
  const Eigen::Vector3d palm_m =
      std::min_element(palms->begin(), palms->end(), [&](const auto& a, const auto& b) {
        return distance_to_box(a.translation(), *object) < distance_to_box(b.translation(), *object);
      })->translation();
  const double distance_m = distance_to_box(palm_m, *object);
  metrics_.emplace_back("palm_distance_m", Metric{distance_m, "m"});
  metrics_.emplace_back("palm_centre_distance_m",
                        Metric{(palm_m - object->X_RootObject.translation()).norm(), "m"});
  const bool near = distance_m <= settings_.reach_m;
  conclude(near, fmt::format("The palm is {:.1f} cm from the {}{}.", 100.0 * distance_m, object_name(),
                             near ? "" : fmt::format("; {:.0f} cm are allowed", 100.0 * settings_.reach_m)));
}

void JudgeCore::judge_drop(double now_s, GroundTruth& truth) {
  if (now_s < *end_s_ + settings_.settle_s || now_s < next_look_s_) return;
  next_look_s_ = now_s + kRestPeriod_s;
  const auto object = truth.object(object_name());
  if (!object) {
    conclude(false, fmt::format("The world does not tell where the {} is: {}", object_name(),
                                object.error().message));
    return;
  }
  const Eigen::Vector3d place_m = object->X_RootObject.translation();
  const bool at_rest = last_place_m_ && (place_m - *last_place_m_).norm() < settings_.rest_m;
  last_place_m_ = place_m;
  if (!at_rest && now_s < *end_s_ + settings_.settle_limit_s) return;
  const auto inside = truth.inside(object_name(), settings_.basket);
  if (!inside) {
    conclude(false, fmt::format("The world does not tell what is in the {}: {}", settings_.basket,
                                inside.error().message));
  } else if (!*inside) {
    conclude(false, fmt::format("The {} is not in the {}.", object_name(), settings_.basket));
  } else if (!at_rest) {
    conclude(false, fmt::format("The {} has not come to rest in the {}.", object_name(), settings_.basket));
  } else {
    conclude(true, fmt::format("The {} lies in the {}.", object_name(), settings_.basket));
    outcome_->object_in_basket = true;
  }
}

void JudgeCore::give_up(double now_s, const std::string& sentence) {
  if (outcome_) return;
  if (!end_s_) end_s_ = now_s;
  conclude(false, sentence);
}

void JudgeCore::conclude(bool success, const std::string& sentence) {
  Outcome outcome;
  outcome.success = success;
  outcome.heard = heard_text_;
  outcome.sentence = sentence;
  if (phrase_) {
    outcome.goal = verb_name(book_.phrases[*phrase_].verb);
    outcome.object = object_name();
  }
  if (success) {
    outcome.stage = last_done_;
  } else if (!heard_text_.empty() && phrase_ && (said_.empty() || said_.front() == heard_text_)) {
    // what goal selection believes to have done, or where it gave up
    const bool gave_up = end_s_ && !end_good_ && !last_failed_.empty();
    outcome.stage = gave_up ? last_failed_ : last_done_;
  } else {
    outcome.stage = "heard";
  }
  outcome_ = outcome;

  metrics_.emplace_back("success", Metric{success ? 1.0 : 0.0, ""});
  metrics_.emplace_back("failed_tries", Metric{static_cast<double>(failed_tries_), ""});
  for (const auto& stage : kStages) {
    if (const auto found = done_s_.find(stage); found != done_s_.end()) {
      metrics_.emplace_back("time_to_" + stage + "_s", Metric{found->second, "s"});
    }
  }
}

}  // namespace nido
