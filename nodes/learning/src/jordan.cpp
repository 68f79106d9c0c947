#include "nido/learning/jordan.h"

#include <algorithm>
#include <cstdlib>
#include <iostream>

namespace nido::learning {
namespace {

void require(bool condition, const char* what) {
  if (!condition) {
    std::cerr << "bug: Jordan network: " << what << '\n';
    std::abort();
  }
}

}  // namespace

JordanNetwork::JordanNetwork(Mlp network, double state_decay)
    : network_(std::move(network)),
      state_decay_(state_decay),
      state_(Eigen::VectorXd::Zero(network_.output_size())) {}

JordanNetwork JordanNetwork::random(Sizes sizes, double state_decay, std::uint64_t seed, double range) {
  require(sizes.inputs > 0 && sizes.hidden > 0 && sizes.outputs > 0, "a layer without units");
  require(state_decay >= 0.0 && state_decay < 1.0, "state decay outside 0..1");
  return {
      Mlp::random(sizes.inputs + sizes.outputs,
                  {{sizes.hidden, Activation::kSigmoid}, {sizes.outputs, Activation::kSigmoid}}, seed, range),
      state_decay};
}

Result<JordanNetwork> JordanNetwork::read_from(const WeightsFile& file, const std::string& name) {
  auto network = Mlp::read_from(file, name);
  if (!network) return network.error();
  auto decay = file.matrix(name + ".state_decay", 1, 1);
  if (!decay) return decay.error();
  const auto sigmoid = [](const MlpLayer& layer) { return layer.activation == Activation::kSigmoid; };
  const auto& layers = network->layers();
  if (layers.size() != 2 || network->input_size() <= network->output_size() ||
      !std::all_of(layers.begin(), layers.end(), sigmoid) ||
      !((*decay)(0, 0) >= 0.0 && (*decay)(0, 0) < 1.0)) {
    return Error{ErrorCode::kInvalidArgument,
                 "network '" + name +
                     "' is no Jordan network: expected two sigmoid layers, more inputs than outputs "
                     "and a state decay from 0 to below 1"};
  }
  return JordanNetwork(std::move(*network), (*decay)(0, 0));
}

void JordanNetwork::write_to(WeightsFile& file, const std::string& name) const {
  network_.write_to(file, name);
  file.matrices[name + ".state_decay"] = Eigen::MatrixXd::Constant(1, 1, state_decay_);
}

void JordanNetwork::reset() { state_.setZero(); }

void JordanNetwork::set_state(const Eigen::VectorXd& state) {
  require(state.size() == state_.size(), "state of a wrong size");
  state_ = state;
}

Eigen::VectorXd JordanNetwork::joined(const Eigen::VectorXd& input) const {
  require(input.size() == input_size(), "input of a wrong size");
  Eigen::VectorXd joined(input.size() + state_.size());
  joined << input, state_;
  return joined;
}

Eigen::VectorXd JordanNetwork::peek(const Eigen::VectorXd& input) const {
  return network_.forward(joined(input));
}

void JordanNetwork::feed_back(const Eigen::VectorXd& output) {
  require(output.size() == state_.size(), "output of a wrong size");
  state_ = state_decay_ * state_ + (1.0 - state_decay_) * output;
}

Eigen::VectorXd JordanNetwork::step(const Eigen::VectorXd& input) {
  Eigen::VectorXd output = peek(input);
  feed_back(output);
  return output;
}

double JordanNetwork::train_sequence(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets,
                                     double rate) {
  require(inputs.cols() == targets.cols() && targets.rows() == output_size(), "sequence of a wrong size");
  reset();
  double sum = 0.0;
  for (Eigen::Index i = 0; i < inputs.cols(); ++i) {
    sum += network_.train_pattern(joined(inputs.col(i)), targets.col(i), rate);
    feed_back(targets.col(i));
  }
  return inputs.cols() == 0 ? 0.0 : sum / static_cast<double>(targets.size());
}

RewardPenaltyLearner::RewardPenaltyLearner(JordanNetwork network, RewardPenaltyOptions options,
                                           std::uint64_t seed)
    : network_(std::move(network)), options_(options), random_(seed) {
  require(options_.draws >= 1, "a unit needs at least one draw");
}

void RewardPenaltyLearner::begin() {
  steps_.clear();
  network_.reset();
}

Eigen::VectorXd RewardPenaltyLearner::act_without_feedback(const Eigen::VectorXd& input) {
  const auto draw = [&](const Eigen::VectorXd& probability, int draws) {
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    Eigen::VectorXd drawn(probability.size());
    for (Eigen::Index i = 0; i < probability.size(); ++i) {
      int on = 0;
      for (int k = 0; k < draws; ++k) on += uniform(random_) < probability(i) ? 1 : 0;
      drawn(i) = static_cast<double>(on) / draws;
    }
    return drawn;
  };
  Step step;
  step.activities = network_.network().activities(network_.joined(input));
  step.hidden_probability = step.activities[1];
  if (options_.stochastic_hidden) {
    step.activities[1] = draw(step.hidden_probability, 1);
    const MlpLayer& output = network_.network().layers()[1];
    const Eigen::VectorXd net = output.weights * step.activities[1] + output.bias;
    step.activities[2] = (1.0 + (-net.array()).exp()).inverse().matrix();
  }
  step.action = draw(step.activities[2], options_.draws);
  steps_.push_back(step);
  return steps_.back().action;
}

void RewardPenaltyLearner::executed(const Eigen::VectorXd& output) { network_.feed_back(output); }

Eigen::VectorXd RewardPenaltyLearner::act(const Eigen::VectorXd& input) {
  Eigen::VectorXd action = act_without_feedback(input);
  executed(action);
  return action;
}

void RewardPenaltyLearner::learn(double reward) { learn_each(std::vector<double>(steps_.size(), reward)); }

void RewardPenaltyLearner::learn_each(const std::vector<double>& rewards) {
  require(rewards.size() == steps_.size(), "one reward a step is needed");
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const double reward = std::clamp(rewards[i], 0.0, 1.0);
    change(steps_[i], reward, 1.0 - reward);
  }
  steps_.clear();
}

void RewardPenaltyLearner::learn_compared(double reward, double expected) {
  const double surplus = std::clamp(reward, 0.0, 1.0) - std::clamp(expected, 0.0, 1.0);
  for (const Step& step : steps_) change(step, std::max(0.0, surplus), std::max(0.0, -surplus));
  steps_.clear();
}

void RewardPenaltyLearner::change(const Step& step, double better, double worse) {
  const auto delta = [&](const Eigen::VectorXd& action, const Eigen::VectorXd& probability) {
    return Eigen::VectorXd(better * (action - probability) +
                           options_.penalty_ratio * worse * ((1.0 - action.array()).matrix() - probability));
  };
  Mlp& network = network_.network();
  MlpGradient direction =
      network.gradient_from_output_delta(step.activities, delta(step.action, step.activities[2]));
  if (options_.stochastic_hidden) {
    const Eigen::VectorXd hidden = delta(step.activities[1], step.hidden_probability);
    direction.weights[0] = -hidden * step.activities[0].transpose();
    direction.bias[0] = -hidden;
  }
  network.add(direction, -options_.rate);
}

}  // namespace nido::learning
