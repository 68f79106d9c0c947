#include "nido/grasp/policies.h"

#include <memory>

#include "nido/grasp/fingers.h"

namespace nido::grasp {

namespace {
constexpr int kHiddenUnits = 5;  // the paper's number
}

GraspCore::Policy learned_policy(learning::JordanNetwork network) {
  auto shared = std::make_shared<learning::JordanNetwork>(std::move(network));
  return [shared](const Eigen::VectorXd& touch, bool first) {
    if (first) shared->reset();
    return shared->step(touch);
  };
}

Result<learning::JordanNetwork> load_grasp_network(const std::string& path) {
  auto file_result = learning::WeightsFile::load(path);
  if (!file_result) return file_result.error();
  auto network_result = learning::JordanNetwork::read_from(*file_result, "grasp");
  if (!network_result)
    return Error{network_result.error().code, path + ": " + network_result.error().message};
  if (network_result->input_size() != static_cast<int>(kPadCount) ||
      network_result->output_size() != static_cast<int>(kFingerCount)) {
    return Error{ErrorCode::kInvalidArgument,
                 path + ": the network has " + std::to_string(network_result->input_size()) + " inputs and " +
                     std::to_string(network_result->output_size()) +
                     " outputs; grasping needs 6 touch pads and 8 finger joints"};
  }
  return network_result;
}

GraspLearner::GraspLearner(Options options, std::uint64_t seed)
    : expectation_share_(options.expectation_share),
      learner_(learning::JordanNetwork::random(
                   {static_cast<int>(kPadCount), kHiddenUnits, static_cast<int>(kFingerCount)}, 0.0, seed),
               {options.rate, options.penalty_ratio, options.draws, false}, seed + 1) {}

GraspCore::Policy GraspLearner::policy() {
  return [this](const Eigen::VectorXd& touch, bool first) {
    if (first) learner_.begin();
    return learner_.act(touch);
  };
}

void GraspLearner::reward(double reward) {
  if (expectation_share_ > 0) {
    learner_.learn_compared(reward, expected_);
    expected_ += expectation_share_ * (reward - expected_);
  } else {
    learner_.learn(reward);
  }
}

}  // namespace nido::grasp
