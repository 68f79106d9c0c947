#include "nido/learning/jordan.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nido::learning {
namespace {

Eigen::VectorXd one_hot(int size, int index) { return Eigen::VectorXd::Unit(size, index); }

TEST(JordanNetwork, StateUnitsTakeInTheOutputs) {
  JordanNetwork copy = JordanNetwork::random({.inputs = 6, .hidden = 5, .outputs = 8}, 0.0, 1);
  EXPECT_TRUE(copy.state().isZero());
  const Eigen::VectorXd first = copy.step(Eigen::VectorXd::Zero(6));
  EXPECT_EQ(copy.state(), first);
  EXPECT_NE(copy.step(Eigen::VectorXd::Zero(6)), first)
      << "the same touch after another posture is another situation";
  copy.reset();
  EXPECT_EQ(copy.step(Eigen::VectorXd::Zero(6)), first);

  JordanNetwork slow = JordanNetwork::random({.inputs = 6, .hidden = 5, .outputs = 8}, 0.75, 1);
  const Eigen::VectorXd output = slow.step(Eigen::VectorXd::Zero(6));
  EXPECT_TRUE(slow.state().isApprox(0.25 * output));
}

TEST(JordanNetwork, LearnsToGiveTwoSequencesFromTwoConstantInputs) {
  // the same output 1 is followed by 0 in one sequence and by 1 in the other, so the state is needed
  Eigen::MatrixXd inputs_a = Eigen::MatrixXd::Zero(2, 4);
  inputs_a.row(0).setOnes();
  Eigen::MatrixXd inputs_b = Eigen::MatrixXd::Zero(2, 4);
  inputs_b.row(1).setOnes();
  Eigen::MatrixXd targets_a(2, 4);
  targets_a << 1, 0, 1, 0, 0, 1, 0, 1;
  Eigen::MatrixXd targets_b(2, 4);
  targets_b << 1, 1, 0, 0, 0, 1, 1, 0;
  JordanNetwork network = JordanNetwork::random({.inputs = 2, .hidden = 6, .outputs = 2}, 0.0, 3, 1.0);
  double error = 1.0;
  for (int pass = 0; pass < 4000; ++pass) {
    error =
        network.train_sequence(inputs_a, targets_a, 0.5) + network.train_sequence(inputs_b, targets_b, 0.5);
  }
  EXPECT_LT(error, 0.02);
  // free running: fed by its own outputs
  const auto largest_error = [&](const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets) {
    network.reset();
    double largest = 0.0;
    for (Eigen::Index i = 0; i < inputs.cols(); ++i) {
      largest = std::max(largest, (network.step(inputs.col(i)) - targets.col(i)).cwiseAbs().maxCoeff());
    }
    return largest;
  };
  EXPECT_LT(largest_error(inputs_a, targets_a), 0.35);
  EXPECT_LT(largest_error(inputs_b, targets_b), 0.35);
}

TEST(JordanNetwork, GradientThroughInputAndStateIsExact) {
  JordanNetwork network = JordanNetwork::random({.inputs = 2, .hidden = 5, .outputs = 3}, 0.0, 8, 1.0);
  network.step(Eigen::Vector2d(0.0, 1.0));
  const Eigen::VectorXd joined = network.joined(Eigen::Vector2d(1.0, 0.0));
  ASSERT_EQ(joined.size(), 5);
  const Eigen::Vector3d target(0.1, 0.9, 0.4);
  const MlpGradient gradient = network.network().gradient(joined, target);
  constexpr double kStep = 1e-6;
  const auto error_with = [&](double step) {
    std::vector<MlpLayer> layers = network.network().layers();
    layers[0].weights(2, 4) += step;  // from a state unit
    return 0.5 * (target - Mlp::from_layers(layers)->forward(joined)).squaredNorm();
  };
  EXPECT_NEAR(gradient.weights[0](2, 4), (error_with(kStep) - error_with(-kStep)) / (2.0 * kStep), 1e-9);
}

// The mean change of the weights over the draws of rewarded actions must follow the slope of the expected
// reward (Williams 1992 for lambda = 0): checked against a sum over both actions of one unit.
TEST(RewardPenalty, MeanChangeFollowsTheSlopeOfTheExpectedReward) {
  const JordanNetwork start = JordanNetwork::random({.inputs = 1, .hidden = 2, .outputs = 1}, 0.0, 4, 1.0);
  const Eigen::VectorXd input = Eigen::VectorXd::Constant(1, 1.0);
  const auto reward_of = [](const Eigen::VectorXd& action) { return action(0) > 0.5 ? 0.9 : 0.2; };
  constexpr double kRate = 1e-3;
  constexpr int kDraws = 40000;
  double change = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    RewardPenaltyLearner learner(start, {.rate = kRate, .penalty_ratio = 0.0}, static_cast<std::uint64_t>(i));
    learner.begin();
    learner.learn(reward_of(learner.act(input)));
    change +=
        learner.network().network().layers()[0].weights(0, 0) - start.network().layers()[0].weights(0, 0);
  }
  const auto expected_reward = [&](double step) {
    std::vector<MlpLayer> layers = start.network().layers();
    layers[0].weights(0, 0) += step;
    const double p = Mlp::from_layers(layers)->forward(start.joined(input))(0);
    return p * 0.9 + (1.0 - p) * 0.2;
  };
  const double slope = (expected_reward(1e-5) - expected_reward(-1e-5)) / 2e-5;
  EXPECT_NEAR(change / kDraws / kRate, slope, 0.1 * std::abs(slope));
}

// A two-armed bandit whose better arm depends on the situation, with noisy rewards.
double bandit_success(bool stochastic_hidden, std::uint64_t seed) {
  RewardPenaltyLearner learner(JordanNetwork::random({.inputs = 2, .hidden = 5, .outputs = 1}, 0.0, seed),
                               {.rate = 0.4, .penalty_ratio = 0.05, .stochastic_hidden = stochastic_hidden},
                               seed);
  std::mt19937_64 random(seed + 100);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  int right = 0;
  constexpr int kTrials = 6000;
  constexpr int kCounted = 1000;
  for (int trial = 0; trial < kTrials; ++trial) {
    const int situation = static_cast<int>(random() % 2);
    learner.begin();
    const bool action = learner.act(one_hot(2, situation))(0) > 0.5;
    const bool better = action == (situation == 1);
    learner.learn(uniform(random) < (better ? 0.9 : 0.1) ? 1.0 : 0.0);
    if (trial >= kTrials - kCounted && better) ++right;
  }
  return static_cast<double>(right) / kCounted;
}

TEST(RewardPenalty, LearnsWhichActionPaysInWhichSituation) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    EXPECT_GT(bandit_success(false, seed), 0.9) << "seed " << seed;
    EXPECT_GT(bandit_success(true, seed), 0.85) << "seed " << seed;
  }
}

TEST(RewardPenalty, GradedActionsApproachThePositionThatPaysMost) {
  RewardPenaltyLearner learner(JordanNetwork::random({.inputs = 1, .hidden = 5, .outputs = 2}, 0.0, 2),
                               {.rate = 0.3, .penalty_ratio = 0.01, .draws = 8}, 2);
  const Eigen::VectorXd input = Eigen::VectorXd::Constant(1, 1.0);
  const Eigen::Vector2d best(0.9, 0.2);
  const auto distance = [&] {
    JordanNetwork network = learner.network();
    network.reset();
    return (network.peek(input) - best).norm();
  };
  const double before = distance();
  for (int trial = 0; trial < 3000; ++trial) {
    learner.begin();
    const double miss = (learner.act(input) - best).norm();
    learner.learn(std::exp(-miss * miss / 0.1));
  }
  EXPECT_GT(before, 0.35);
  EXPECT_LT(distance(), 0.15);
}

// compared with what was expected: better makes the action likelier, worse less likely, the same changes
// nothing
TEST(RewardPenalty, OnlyWhatIsBetterOrWorseThanExpectedTeaches) {
  const Eigen::VectorXd input = Eigen::VectorXd::Constant(1, 1.0);
  const auto change = [&](double reward, double expected) {
    RewardPenaltyLearner learner(JordanNetwork::random({.inputs = 1, .hidden = 5, .outputs = 1}, 0.0, 4),
                                 {.rate = 0.5, .penalty_ratio = 0.1}, 4);
    const auto probability = [&] {
      JordanNetwork network = learner.network();
      network.reset();
      return network.peek(input)(0);
    };
    const double before = probability();
    learner.begin();
    const double action = learner.act(input)(0);
    learner.learn_compared(reward, expected);
    return (probability() - before) * (action > 0.5 ? 1 : -1);
  };
  EXPECT_GT(change(1.0, 0.4), 1e-3);
  EXPECT_GT(change(1.0, 0.4), change(0.6, 0.4));
  EXPECT_LT(change(0.1, 0.4), -1e-5);
  EXPECT_DOUBLE_EQ(change(1.0, 1.0), 0.0);
  EXPECT_DOUBLE_EQ(change(0.3, 0.3), 0.0);
}

TEST(JordanNetwork, SurvivesAFileAndRefusesAnother) {
  const JordanNetwork network = JordanNetwork::random({.inputs = 6, .hidden = 5, .outputs = 8}, 0.5, 9);
  WeightsFile file;
  file.command = "test";
  network.write_to(file, "grasp");
  auto copy = JordanNetwork::read_from(WeightsFile::from_text(file.to_text(), "text").value(), "grasp");
  ASSERT_TRUE(copy.ok()) << copy.error().message;
  JordanNetwork original = network;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(copy->step(one_hot(6, i)), original.step(one_hot(6, i)));
  }
  WeightsFile wrong;
  Mlp::random(3, {{5, Activation::kSigmoid}, {8, Activation::kSigmoid}}, 1).write_to(wrong, "grasp");
  wrong.matrices["grasp.state_decay"] = Eigen::MatrixXd::Zero(1, 1);
  EXPECT_FALSE(JordanNetwork::read_from(wrong, "grasp").ok());
}

}  // namespace
}  // namespace nido::learning
