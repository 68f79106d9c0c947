#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nido/goal_selection/goal_network.h"
#include "nido/interfaces/result.h"
#include "nido/speech/lesson.h"

namespace nido {

// Bounds and distances of the behaviour. Times in s, lengths in m.
struct GoalSelectionSettings {
  // Hand that acts. "nearer": the right one for what lies on the right, the left one for the rest.
  std::string side = "right";
  std::string basket = "basket";           // name of the basket's percept
  int tries = 3;                           // attempts at an object before a failure is final
  double lowest_percept_confidence = 0.3;  // 0..1; what vision is less sure of is not seen
  std::size_t percepts_for_position = 5;   // views that a position is taken from (median)
  double view_memory_s = 1.0;              // views older than this are not used
  double fixation_wait_s = 4.0;    // a target that is seen but not centred by then is taken as it is seen
  double search_limit_s = 30.0;    // a search that does not end by itself
  double reach_limit_s = 25.0;     // one action of the arm
  double grasp_limit_s = 20.0;     // one action of the fingers
  double job_limit_s = 240.0;      // everything that one phrase asks for
  double lost_touch_s = 1.0;       // an object that was felt is lost when no pad was on for this long
  double lift_height_m = 0.12;     // that an object is lifted by
  double rest_tolerance_m = 0.03;  // an object seen this near to its old place after a lift was not lifted
  double release_height_m = 0.10;  // of the held object's centre over the basket's rim
  double hold_s = 4.0;             // how long "grasp" holds before the job is done
  double check_s = 1.0;            // looking whether a lift worked
  double drop_check_s = 4.0;       // looking whether it lies in the basket
};

// One thing that vision sees, as far as this node needs it.
struct SeenObject {
  std::string name;
  std::string colour;
  std::string shape;
  double confidence = 0.0;                                   // 0..1
  Eigen::Vector3d p_RootObject_m = Eigen::Vector3d::Zero();  // centre
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();          // along root x, y, z
  double yaw_rad = 0.0;
};

struct PhraseHeard {
  std::string text;
  double confidence = 0.0;
  bool accepted = false;
  std::string reason;
};

struct GazeState {
  std::string mode;
  std::string target;
  bool fixated = false;
  bool search_done = false;
};

struct ActionState {
  std::uint32_t id = 0;
  std::string action;
  std::string state;   // "running", "done", "failed"
  std::string reason;  // a sentence, when failed
  double error_m = 0.0;
};

// What arrived since the last step. Only senses and the reports of the other nodes.
struct GoalSelectionInputs {
  std::vector<PhraseHeard> heard;                  // every phrase
  std::optional<std::vector<SeenObject>> objects;  // a new view of the scene
  std::optional<GazeState> gaze;                   // latest
  std::vector<ActionState> reach;                  // every status
  std::vector<ActionState> grasp;                  // every status
  // latest, of the acting hand: five finger tips, palm; with side "nearer" of the right one
  std::optional<std::array<bool, 6>> touch_on;
  std::optional<std::array<bool, 6>> left_touch_on;  // with side "nearer" only
};

struct GazeCommand {
  std::string mode;  // "rest", "search", "object", "hand"
  std::string target;
};

struct ActionCommand {
  std::uint32_t id = 0;
  std::string action;
  std::string object;
  Eigen::Vector3d p_RootTarget_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  std::string side;  // of the hand: "right" or "left"
};

struct StageLine {
  std::string stage;  // "heard", "chosen", "seen", "reached", "grasped", "carried", "dropped", "idle"
  std::string state;  // "begin", "done", "failed"
  std::string object;
  std::string text;  // a sentence for people
};

struct GoalSelectionOutputs {
  std::vector<GazeCommand> gaze;
  std::vector<ActionCommand> reach;
  std::vector<ActionCommand> grasp;
  std::vector<StageLine> stages;
  bool taught = false;  // the network has learned a lesson in this step
};

// Selects goals and carries them out through the other nodes: hears a phrase, looks for the object, lets the
// network choose, then asks reach and grasp for one action after the other and watches by touch and sight
// whether they worked. The end of a job is the stage "idle" with state "done" or "failed"; then it listens
// again. A phrase that comes during a job waits its turn (kMostWaiting of them). An interruption ("stop")
// ends the job in the step that hears it: arm and fingers stop where they are, what is held is kept, what
// waits is forgotten. Deterministic, no clock of its own. Not thread-safe.
class GoalSelectionCore {
 public:
  static constexpr std::size_t kMostWaiting = 4;  // phrases
  // kInvalidArgument for settings out of range.
  static Result<GoalSelectionCore> create(const PhraseBook& book, GoalNetwork network,
                                          const GoalSelectionSettings& settings);

  // `now_s` must not run backward.
  GoalSelectionOutputs step(double now_s, const GoalSelectionInputs& inputs);

  // What it is doing now, for people: "listening", "looking for the blue cube", ...
  [[nodiscard]] const std::string& doing() const { return doing_; }

  // What bare names of taught things ask for (docs/goal_selection.md), and what was taught before this start.
  [[nodiscard]] const std::vector<GoalLesson>& lessons() const { return network_.lessons(); }
  Status teach(const GoalLesson& lesson) { return network_.teach(lesson); }

 private:
  enum class State {
    kListen,        // nothing to do
    kFind,          // search until the object is seen
    kFixate,        // centre it, then take its position
    kChangeHands,   // the other hand is to act: this one goes home first
    kReach,         // the hand goes to it: job "reach"
    kPregrasp,      // the hand opens and goes round it
    kClose,         // the fingers close
    kLift,          // the arm goes up
    kCheckLift,     // is it in the hand, is it gone from the table?
    kHold,          // job "grasp": hold it for a while
    kFindBasket,    // search until the basket is seen
    kFixateBasket,  // centre it, then take its position
    kCarry,         // over the basket
    kRelease,       // the fingers open
    kGoHome,        // the hand gets out of the way
    kCheckDrop,     // is it in the basket?
    kBackOff,       // after a failure: open the hand, take it away, then look again
  };
  enum class Progress { kNone, kRunning, kDone, kFailed };
  // An action that was asked of another node.
  struct Asked {
    std::uint32_t id = 0;  // 0: nothing was asked
    std::string action;
    double deadline_s = 0.0;
    Progress progress = Progress::kNone;
    std::string reason;  // of a failure
  };
  using Views = std::deque<std::pair<double, SeenObject>>;  // time, view; oldest first

  GoalSelectionCore(const PhraseBook& book, GoalNetwork network, const GoalSelectionSettings& settings);

  void take_in(const GoalSelectionInputs& inputs);
  void hear(const PhraseHeard& heard);
  // The phrase that a text is; one about a thing that was taught is added to the book.
  std::optional<std::size_t> phrase_of(const std::string& text);
  // What the network was taught about a bare name. For the rest, as it learned with the things of the book
  // alone: the same said of one of the same shape as `seen`; others are taken like balls.
  [[nodiscard]] GoalNetwork::Choice choose(const SeenObject& seen) const;
  // What arm and fingers are told: they go by the shape, which names that people give do not end with.
  [[nodiscard]] std::string name_and_shape() const;
  // The order under way was the end of a lesson: the network learns it with the thing as it is seen.
  void learn(const SeenObject& seen);
  void interrupt(const std::string& text);
  void begin(std::size_t phrase);
  // The object in the hand, as far as touch tells; empty if there is none.
  [[nodiscard]] std::string in_hand() const;
  void advance();

  void step_find();
  void step_fixate();
  // True if the hand that is to act is not the one that acted, and has to wait until that one is home.
  bool change_hands();
  void step_change_hands();
  void step_reach();
  void step_pregrasp();
  void step_close();
  void step_lift();
  void step_check_lift();
  void step_hold();
  void step_find_basket();
  void step_fixate_basket();
  void carry_to_basket();
  void step_carry();
  void step_release();
  void step_go_home();
  void step_check_drop();
  void step_back_off();
  // What both searches share: true when the target is seen; `missing` is said when it is nowhere.
  bool found(const std::string& name, const std::string& stage, const std::string& missing);
  // True when the target is centred (or was long enough in view) and measured.
  bool measured(const std::string& name, SeenObject& result);
  // True if the object was lost; the failure is dealt with then.
  bool lost_it(const std::string& stage);

  void enter(State state, const std::string& doing);
  void look(const std::string& mode, const std::string& target);
  void ask_reach(const std::string& action, const Eigen::Vector3d& p_RootTarget_m);
  void ask_grasp(const std::string& action);
  void say(const std::string& stage, const std::string& state, const std::string& text);
  void finish(bool success, const std::string& text);
  // A stage did not work: looks again if tries are left, else ends the job.
  void stage_failed(const std::string& stage, const std::string& sentence, bool worth_another_try = true);
  // The arm did not get there: if that was too far for it, the other one may try, else nobody.
  void reach_failed(const std::string& stage, const std::string& what);
  // The hand for the job, by where things are seen.
  [[nodiscard]] std::string hand_for_job() const;
  // "hand", or where it could be either one "left hand".
  [[nodiscard]] std::string hand_text() const;
  [[nodiscard]] bool picks_hand() const { return settings_.side == "nearer"; }

  [[nodiscard]] const std::string& object_name() const;
  // Median of the views since `since_s` that are not too old; nothing with fewer than `count`.
  [[nodiscard]] std::optional<SeenObject> view_of(const std::string& name, std::size_t count,
                                                  double since_s) const;
  [[nodiscard]] double in_state_s() const { return now_s_ - entered_s_; }

  PhraseBook book_;          // first the objects and phrases that the network learned with
  std::size_t learned_ = 0;  // so many objects
  GoalNetwork network_;
  GoalSelectionSettings settings_;

  State state_ = State::kListen;
  bool started_ = false;
  double now_s_ = 0.0;
  double entered_s_ = 0.0;
  std::string doing_;

  // the job
  std::size_t phrase_ = 0;
  Action action_ = Action::kIdle;
  bool chosen_ = false;
  int try_number_ = 1;
  std::string side_;        // of the hand that acts, or acted last
  std::string only_side_;   // of the hand that is left for this job; empty: either
  bool hand_away_ = false;  // that hand is not at home
  double job_started_s_ = 0.0;
  LessonListener lesson_listener_;
  std::map<std::string, Verb> to_learn_;  // by name: lessons that were heard and whose thing is to be seen
  std::deque<std::size_t> waiting_;       // phrases for later, oldest first
  std::string held_;                      // object that was lifted and not let go since; empty: none
  bool was_felt_ = false;                 // a pad was on since the fingers closed
  SeenObject target_;                     // as measured before the hand came near
  SeenObject basket_;

  // the senses
  std::map<std::string, Views> views_;
  GazeState gaze_;
  double last_touch_s_ = -1e9;

  // the others
  std::uint32_t next_id_ = 1;
  Asked reach_;
  Asked grasp_;
  double reach_error_m_ = 0.0;
  GazeCommand looking_;

  GoalSelectionOutputs out_;
};

}  // namespace nido
