#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "nido/goal_selection/goal_network.h"
#include "nido/learning/training.h"

namespace nido {

// The paper's Table V.
struct GoalTrainingOptions {
  long iterations = 50000;  // presentations of one pattern
  double rate = 0.07;
  std::uint64_t seed = 1;    // first weights, patterns and their order
  std::size_t held_out = 0;  // verb-object pairs that are left out of learning and used as the test set
};

struct GoalTrainingReport {
  std::vector<learning::CurvePoint> curve;  // root mean squared error by iteration
  double rmse_train = 0.0;
  double rmse_test = 0.0;
  double accuracy = 0.0;             // share of the test patterns whose strongest output is the right one
  double idle_without_speech = 0.0;  // share of test objects without a phrase that leave the robot idle
  double held_out_accuracy = 0.0;    // only with held_out > 0
};

struct GoalTraining {
  learning::Mlp network;
  GoalTrainingReport report;
};

// Patterns for every phrase once: the named object somewhere on a table, seen with the noise of the eyes.
learning::Patterns goal_patterns(const GoalCode& code, const std::vector<std::size_t>& phrases,
                                 std::uint64_t seed);

// Trains a network on one pattern a phrase and tests it on others. Same options, same result.
GoalTraining train_goal_network(const GoalCode& code, const GoalTrainingOptions& options);

}  // namespace nido
