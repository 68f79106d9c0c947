// what people teach the network after it has learned the phrases
#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "nido/goal_selection/goal_network.h"
#include "nido/goal_selection/goal_training.h"
#include "nido/learning/weights_file.h"

namespace nido {

namespace {

constexpr double kRate = 0.5;
constexpr double kSure = 0.8;       // a lesson is learned when the right output is above
constexpr double kUnsure = 0.2;     // and the others are below, wherever the thing stands
constexpr int kScenes = 4;          // of every phrase, to keep what was learned before
constexpr int kPlaces = 12;         // of every lesson's thing
constexpr long kIterations = 4000;  // of one round; patterns, one after the other
constexpr int kRounds = 25;
constexpr std::uint64_t kSeed = 71;  // of places and their order

// The first layer gets a further input, which says nothing yet.
Result<learning::Mlp> with_another_input(const learning::Mlp& network) {
  std::vector<learning::MlpLayer> layers = network.layers();
  Eigen::MatrixXd& weights = layers.front().weights;
  weights.conservativeResize(Eigen::NoChange, weights.cols() + 1);
  weights.rightCols(1).setZero();
  return learning::Mlp::from_layers(std::move(layers));
}

void append(learning::Patterns& patterns, const Eigen::VectorXd& input, Action action) {
  const Eigen::Index at = patterns.count();
  patterns.inputs.conservativeResize(input.size(), at + 1);
  patterns.targets.conservativeResize(static_cast<Eigen::Index>(kActionCount), at + 1);
  patterns.inputs.col(at) = input;
  patterns.targets.col(at).setZero();
  patterns.targets(static_cast<Eigen::Index>(action), at) = 1.0;
}

bool is_sure(const learning::Mlp& network, const learning::Patterns& patterns) {
  for (Eigen::Index i = 0; i < patterns.count(); ++i) {
    const Eigen::VectorXd output = network.forward(patterns.inputs.col(i));
    for (Eigen::Index k = 0; k < output.size(); ++k) {
      const bool right = patterns.targets(k, i) > 0.5;
      if (right ? output[k] < kSure : output[k] > kUnsure) return false;
    }
  }
  return true;
}

}  // namespace

Eigen::VectorXd GoalNetwork::encode(const VisionParameters& seen, std::size_t lesson) const {
  Eigen::VectorXd input = Eigen::VectorXd::Zero(network_.input_size());
  input.head(code_.input_size()) = code_.encode(seen, std::nullopt);
  input[code_.input_size() + static_cast<Eigen::Index>(lesson)] = 1.0;
  return input;
}

Status GoalNetwork::teach(const GoalLesson& lesson) {
  GoalNetwork taught = *this;
  const auto same = std::find_if(taught.lessons_.begin(), taught.lessons_.end(),
                                 [&](const GoalLesson& known) { return known.name == lesson.name; });
  if (same == taught.lessons_.end()) {
    auto wider = with_another_input(network_);
    if (!wider) return wider.error();
    taught.network_ = std::move(*wider);
    taught.lessons_.push_back(lesson);
  } else {
    *same = lesson;
  }

  // what it must say from now on: to all lessons, wherever the things stand, to the phrases as before, and
  // nothing to things that nobody speaks of
  learning::Patterns patterns;
  std::mt19937_64 generator(kSeed);
  const auto between = [&generator](double low, double high) {  // the same on every standard library
    return low + (high - low) * static_cast<double>(generator() >> 11U) * 0x1p-53;
  };
  for (std::size_t i = 0; i < taught.lessons_.size(); ++i) {
    for (int place = 0; place < kPlaces; ++place) {
      VisionParameters seen = taught.lessons_[i].seen;
      seen.p_RootObject_m.x() = between(-0.6, -0.2);
      seen.p_RootObject_m.y() = between(-0.3, 0.3);
      seen.width_m *= between(0.85, 1.4);  // as it is turned
      seen.height_m *= between(0.85, 1.15);
      append(patterns, taught.encode(seen, i), taught.lessons_[i].action);
    }
  }
  std::vector<std::size_t> phrases(code_.book().phrases.size());
  std::iota(phrases.begin(), phrases.end(), std::size_t{0});
  Eigen::VectorXd input = Eigen::VectorXd::Zero(taught.network_.input_size());
  for (int scene = 0; scene < kScenes; ++scene) {
    const learning::Patterns known = goal_patterns(code_, phrases, generator());
    for (Eigen::Index i = 0; i < known.count(); ++i) {
      Eigen::Index action = 0;
      known.targets.col(i).maxCoeff(&action);
      input.head(code_.input_size()) = known.inputs.col(i);
      append(patterns, input, kAllActions[static_cast<std::size_t>(action)]);
      input.segment(GoalCode::kVisionInputs, code_.input_size() - GoalCode::kVisionInputs).setZero();
      if (scene == 0) append(patterns, input, Action::kIdle);
    }
  }

  learning::OnlineOptions online;
  online.iterations = kIterations;
  online.rate = kRate;
  online.report_every = kIterations;
  for (int round = 0; round < kRounds; ++round) {
    if (is_sure(taught.network_, patterns)) {
      *this = std::move(taught);
      return {};
    }
    online.seed = generator();
    learning::train_online(taught.network_, patterns, {}, online);
  }
  return Error{ErrorCode::kFailed, fmt::format("the network did not learn to {} at \"{}\"",
                                               action_name(lesson.action), lesson.name)};
}

Status save_lessons(const std::vector<GoalLesson>& lessons, const std::string& path) {
  learning::WeightsFile file;
  file.command = "what people taught";
  for (std::size_t i = 0; i < lessons.size(); ++i) {
    const auto& [name, action, seen] = lessons[i];
    const std::string key = fmt::format("lesson.{}.", i);
    file.notes[key + "name"] = name;
    file.notes[key + "action"] = action_name(action);
    file.notes[key + "colour"] = seen.colour;
    file.notes[key + "shape"] = seen.shape;
    Eigen::VectorXd seen_m(5);
    seen_m << seen.p_RootObject_m, seen.width_m, seen.height_m;
    file.matrices[key + "seen_m"] = seen_m;
  }
  return file.save(path);
}

Result<std::vector<GoalLesson>> load_lessons(const std::string& path) {
  const auto file = learning::WeightsFile::load(path);
  if (!file) return file.error();
  std::vector<GoalLesson> lessons;
  for (std::size_t i = 0; file->notes.contains(fmt::format("lesson.{}.name", i)); ++i) {
    const std::string key = fmt::format("lesson.{}.", i);
    const auto note = [&](const char* what) {
      const auto found = file->notes.find(key + what);
      return found == file->notes.end() ? std::string() : found->second;
    };
    const auto action = std::find_if(kAllActions.begin(), kAllActions.end(),
                                     [&](Action a) { return note("action") == action_name(a); });
    if (action == kAllActions.end()) {
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("{}: the note {}action is '{}'; allowed are idle, reach, grasp, drop", path,
                               key, note("action"))};
    }
    const auto seen_m = file->matrix(key + "seen_m", 5, 1);
    if (!seen_m) return Error{seen_m.error().code, fmt::format("{}: {}", path, seen_m.error().message)};
    lessons.push_back({note("name"),
                       *action,
                       {seen_m->topRows(3), (*seen_m)(3), (*seen_m)(4), note("colour"), note("shape")}});
  }
  return lessons;
}

std::optional<GoalNetwork::Choice> GoalNetwork::choose_by_name(const VisionParameters& seen,
                                                               const std::string& name) const {
  for (std::size_t i = 0; i < lessons_.size(); ++i) {
    if (lessons_[i].name == name) return choice_of(network_.forward(encode(seen, i)));
  }
  return std::nullopt;
}

}  // namespace nido
