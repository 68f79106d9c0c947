#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/judge/ground_truth.h"
#include "nido/report/report.h"
#include "nido/speech/lesson.h"
#include "nido/speech/phrases.h"

namespace nido {

struct JudgeSettings {
  std::string expected;  // what is said, as in split_orders(); empty: whatever was heard counts, one phrase
  // What bare names ask for: orders that end a lesson ("drop plum into basket"), given before this run.
  std::vector<std::string> lessons = {};
  std::string basket = "basket";  // name of the basket in the world
  double table_z_m = -0.0826;     // upper surface of the table, root frame
  double limit_s = 300.0;         // simulated time until the job must be over
  double settle_s = 1.0;          // after the end, until the object is looked at
  double settle_limit_s = 4.0;    // it must have come to rest by then
  double rest_m = 0.002;          // an object that moved less than this in 0.2 s is at rest
  double lift_m = 0.05;           // grasp: clear height of the object's lowest point over the table
  double hold_s = 3.0;            // grasp: so long without a break
  double reach_m = 0.03;          // reach: distance of the palm from the object's surface
  double stop_s =
      0.5;  // an interruption is obeyed when goal selection ends the job and the hand rests by then
  double stop_m = 0.003;  // a hand that moved less than this in 0.2 s rests
};

// A line of the story, as goal selection tells it.
struct StageSeen {
  double time_s = 0.0;
  std::string stage;
  std::string state;
  std::string object;
  std::string text;
};
// What speech made of an utterance.
struct HeardSeen {
  double time_s = 0.0;  // when the answer came
  double end_s = 0.0;   // end of the utterance
  std::string text;     // empty when rejected
  std::string reason;
};

// Decides whether a run did what was asked of it: waits for the end that goal selection announces, of the
// last phrase if several are said, then looks at what is really so. A run that is told to stop last succeeds
// if the robot stops. Not thread-safe; no clock of its own.
class JudgeCore {
 public:
  // kInvalidArgument if `settings` are out of range. An expected phrase that the book does not have is no
  // error: then nothing but staying idle is possible, and that is no success.
  static Result<JudgeCore> create(const PhraseBook& book, const JudgeSettings& settings);

  // True if pictures of this moment belong to the story.
  bool stage(const StageSeen& line);
  void heard(const HeardSeen& heard);
  // Call regularly. Asks the truth while something is held and at the end. True when the outcome is known;
  // then it stays.
  bool tick(double now_s, GroundTruth& truth);
  // Ends the run from outside (the clock stopped, the robot is gone).
  void give_up(double now_s, const std::string& sentence);

  [[nodiscard]] const std::optional<Outcome>& outcome() const { return outcome_; }
  // Metrics of the run: times of the stages, latency of speech, what was measured at the end.
  [[nodiscard]] const std::vector<std::pair<std::string, Metric>>& metrics() const { return metrics_; }

 private:
  JudgeCore(const PhraseBook& book, const JudgeSettings& settings);
  void next_order();
  void learn(const Order& lesson);
  void judge_stop(double now_s, GroundTruth& truth);
  void check_earlier(GroundTruth& truth);
  void watch_hold(double now_s, GroundTruth& truth);
  void conclude(bool success, const std::string& sentence);
  void judge_drop(double now_s, GroundTruth& truth);
  void judge_grasp(double now_s, GroundTruth& truth);
  void judge_reach(GroundTruth& truth);
  [[nodiscard]] const std::string& object_name() const;

  PhraseBook book_;
  LessonListener lesson_listener_;  // a bare name is an order after a lesson
  JudgeSettings settings_;
  std::vector<std::string> said_;         // all that is said, one after the other; empty: not known
  std::size_t orders_ = 1;                // phrases that are said, without interruptions
  std::size_t ended_ = 0;                 // of these
  std::deque<std::size_t> later_;         // heard while another one was carried out
  std::vector<std::string> dropped_;      // objects that earlier orders brought into the basket, as it seems
  std::string earlier_trouble_;           // of an order that was not the last
  std::optional<double> interrupted_s_;   // end of the interruption that was heard
  std::vector<Eigen::Vector3d> palms_m_;  // at the time when it must rest
  std::vector<std::string> heard_texts_;
  std::optional<std::size_t> phrase_;  // heard and known
  std::string heard_text_;
  std::string heard_reason_;
  std::string goal_;
  std::string last_done_;    // stage
  std::string last_failed_;  // stage
  std::string end_text_;
  std::optional<double> first_s_;
  std::optional<double> end_s_;
  bool end_good_ = false;
  int failed_tries_ = 0;
  std::map<std::string, double> done_s_;

  double next_look_s_ = 0.0;
  std::optional<double> held_since_s_;
  double longest_hold_s_ = 0.0;
  std::optional<Eigen::Vector3d> last_place_m_;

  std::optional<Outcome> outcome_;
  std::vector<std::pair<std::string, Metric>> metrics_;
};

}  // namespace nido
