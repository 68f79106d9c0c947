#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/learning/mlp.h"
#include "nido/speech/phrases.h"

namespace nido {

// What the robot may do about a phrase, in the order of the network's outputs.
enum class Action { kIdle, kReach, kGrasp, kDrop };
inline constexpr std::size_t kActionCount = 4;
inline constexpr std::array<Action, kActionCount> kAllActions = {Action::kIdle, Action::kReach,
                                                                 Action::kGrasp, Action::kDrop};
// "idle", "reach", "grasp", "drop".
const char* action_name(Action action);
// What a verb should make the robot do: the teacher's answer. Look is idle: attend, do not act.
Action action_of(Verb verb);

// The seven parameters of one seen object that the network takes.
struct VisionParameters {
  Eigen::Vector3d p_RootObject_m = Eigen::Vector3d::Zero();  // centre
  double width_m = 0.0;                                      // extent along root y
  double height_m = 0.0;                                     // extent along root z
  std::string colour;                                        // one of the book's colours
  std::string shape;                                         // one of the book's shapes
};

// Turns percepts and phrases into the network's inputs (docs/goal_selection.md): seven numbers of vision,
// then one unit a verb (none for look) and one unit an object. A plain value.
class GoalCode {
 public:
  static constexpr int kVisionInputs = 7;

  explicit GoalCode(const PhraseBook& book);
  [[nodiscard]] int input_size() const;
  // `phrase`: index into the book, or nothing while nobody has spoken; `seen`: nothing while nothing is seen.
  // Colours and shapes that the book does not have are coded as 0.
  [[nodiscard]] Eigen::VectorXd encode(const std::optional<VisionParameters>& seen,
                                       const std::optional<std::size_t>& phrase) const;
  [[nodiscard]] const PhraseBook& book() const { return book_; }

 private:
  PhraseBook book_;
  std::vector<std::string> colours_;
  std::vector<std::string> shapes_;
};

// What a person taught about a thing that the phrases do not name: its bare name asks for this action.
struct GoalLesson {
  std::string name;
  Action action = Action::kIdle;
  VisionParameters seen;  // the thing, as it was shown
};

// Lessons as a file (docs/learning.md has the format): the network learns them anew at the next start.
// kFailed with the path; kNotFound, kInvalidArgument with place and what was expected.
Status save_lessons(const std::vector<GoalLesson>& lessons, const std::string& path);
Result<std::vector<GoalLesson>> load_lessons(const std::string& path);

// The feed-forward network that selects the goal: 15 hidden units, one output an action. A value,
// thread-compatible.
class GoalNetwork {
 public:
  static constexpr int kHiddenUnits = 15;

  struct Choice {
    Action action = Action::kIdle;
    std::array<double, kActionCount> activation{};  // 0..1, in the order of Action
  };

  GoalNetwork(GoalCode code, learning::Mlp network);
  // Reads weights for the phrases of `book`. kNotFound if there is no file, kInvalidArgument if it is of
  // another shape.
  static Result<GoalNetwork> load(const std::string& path, const PhraseBook& book);

  [[nodiscard]] Choice choose(const std::optional<VisionParameters>& seen,
                              const std::optional<std::size_t>& phrase) const;
  [[nodiscard]] const learning::Mlp& mlp() const { return network_; }

  // Learns a lesson (docs/goal_selection.md): an input unit for the name, and back-propagation over the
  // lessons and the phrases that it knew before, which it keeps. A second lesson about a name takes the place
  // of the first. kFailed, and nothing is learned, when the network does not get it right.
  Status teach(const GoalLesson& lesson);
  [[nodiscard]] const std::vector<GoalLesson>& lessons() const { return lessons_; }
  // What the bare name of a taught thing asks for; nothing for other names.
  [[nodiscard]] std::optional<Choice> choose_by_name(const VisionParameters& seen,
                                                     const std::string& name) const;

 private:
  [[nodiscard]] Eigen::VectorXd encode(const VisionParameters& seen, std::size_t lesson) const;
  static Choice choice_of(const Eigen::VectorXd& output);

  GoalCode code_;
  learning::Mlp network_;
  std::vector<GoalLesson> lessons_;  // each with an input unit, after those of the code
};

}  // namespace nido
