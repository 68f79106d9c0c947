#include "nido/goal_selection/goal_network.h"

#include <fmt/format.h>

#include <algorithm>

#include "nido/learning/weights_file.h"

namespace nido {

namespace {

// where a table can be and how big what stands on it is; maps to about 0..1
constexpr double kNear_x_m = -0.15;
constexpr double kFar_x_m = -0.65;
constexpr double kLeft_y_m = -0.35;
constexpr double kRight_y_m = 0.35;
constexpr double kLow_z_m = -0.10;
constexpr double kHigh_z_m = 0.20;
constexpr double kBig_m = 0.20;
constexpr const char* kNetworkName = "goal_selection";

double share(double value, double low, double high) { return (value - low) / (high - low); }

// classes 1..n as even steps up to 1; 0 is what the book does not have
double class_code(const std::vector<std::string>& classes, const std::string& value) {
  const auto found = std::find(classes.begin(), classes.end(), value);
  if (found == classes.end()) return 0.0;
  return static_cast<double>(found - classes.begin() + 1) / static_cast<double>(classes.size());
}

void add_class(std::vector<std::string>& classes, const std::string& value) {
  if (std::find(classes.begin(), classes.end(), value) == classes.end()) classes.push_back(value);
}

}  // namespace

const char* action_name(Action action) {
  switch (action) {
    case Action::kIdle:
      return "idle";
    case Action::kReach:
      return "reach";
    case Action::kGrasp:
      return "grasp";
    case Action::kDrop:
      return "drop";
  }
  return "?";
}

Action action_of(Verb verb) {
  switch (verb) {
    case Verb::kLook:
      return Action::kIdle;
    case Verb::kReach:
      return Action::kReach;
    case Verb::kGrasp:
      return Action::kGrasp;
    case Verb::kDrop:
      return Action::kDrop;
  }
  return Action::kIdle;
}

GoalCode::GoalCode(const PhraseBook& book) : book_(book) {
  for (const auto& object : book_.objects) {
    add_class(colours_, object.colour);
    add_class(shapes_, object.shape);
  }
}

int GoalCode::input_size() const {
  return kVisionInputs + static_cast<int>(kVerbCount) - 1 + static_cast<int>(book_.objects.size());
}

Eigen::VectorXd GoalCode::encode(const std::optional<VisionParameters>& seen,
                                 const std::optional<std::size_t>& phrase) const {
  Eigen::VectorXd input = Eigen::VectorXd::Zero(input_size());
  if (seen) {
    input[0] = share(seen->p_RootObject_m.x(), kNear_x_m, kFar_x_m);
    input[1] = share(seen->p_RootObject_m.y(), kLeft_y_m, kRight_y_m);
    input[2] = share(seen->p_RootObject_m.z(), kLow_z_m, kHigh_z_m);
    input[3] = seen->width_m / kBig_m;
    input[4] = seen->height_m / kBig_m;
    input[5] = class_code(colours_, seen->colour);
    input[6] = class_code(shapes_, seen->shape);
    // a wild measurement must not drive the network where it was never trained
    input.head<kVisionInputs>() = input.head<kVisionInputs>().cwiseMax(-0.5).cwiseMin(1.5);
  }
  if (phrase) {
    const Phrase& said = book_.phrases[*phrase];
    if (said.verb != Verb::kLook) {
      input[kVisionInputs + static_cast<int>(said.verb) - 1] = 1.0;
    }
    input[kVisionInputs + static_cast<int>(kVerbCount) - 1 + static_cast<int>(said.object_index)] = 1.0;
  }
  return input;
}

GoalNetwork::GoalNetwork(GoalCode code, learning::Mlp network)
    : code_(std::move(code)), network_(std::move(network)) {}

Result<GoalNetwork> GoalNetwork::load(const std::string& path, const PhraseBook& book) {
  const auto file = learning::WeightsFile::load(path);
  if (!file) return file.error();
  auto network = learning::Mlp::read_from(*file, kNetworkName);
  if (!network) {
    return Error{network.error().code, fmt::format("{}: {}", path, network.error().message)};
  }
  GoalCode code(book);
  if (network->input_size() != code.input_size() ||
      network->output_size() != static_cast<int>(kActionCount)) {
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("{}: the network has {} inputs and {} outputs; these phrases need {} and {}: train it "
                    "anew with nido-experiment-goal-learning",
                    path, network->input_size(), network->output_size(), code.input_size(), kActionCount)};
  }
  return GoalNetwork(std::move(code), std::move(network).value());
}

GoalNetwork::Choice GoalNetwork::choose(const std::optional<VisionParameters>& seen,
                                        const std::optional<std::size_t>& phrase) const {
  Eigen::VectorXd input = Eigen::VectorXd::Zero(network_.input_size());
  input.head(code_.input_size()) = code_.encode(seen, phrase);
  return choice_of(network_.forward(input));
}

GoalNetwork::Choice GoalNetwork::choice_of(const Eigen::VectorXd& output) {
  Choice choice;
  for (std::size_t i = 0; i < kActionCount; ++i) {
    choice.activation[i] = output[static_cast<Eigen::Index>(i)];
  }
  const auto best = std::max_element(choice.activation.begin(), choice.activation.end());
  choice.action = kAllActions[static_cast<std::size_t>(best - choice.activation.begin())];
  return choice;
}

}  // namespace nido
