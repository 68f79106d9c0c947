#include "nido/goal_selection/goal_training.h"

#include <algorithm>
#include <numeric>
#include <random>

namespace nido {

namespace {

// evenly in [low, high); the same on every standard library
double uniform(std::mt19937_64& generator, double low, double high) {
  return low + (high - low) * static_cast<double>(generator() >> 11U) * 0x1p-53;
}

VisionParameters show(const NamedObject& object, std::mt19937_64& generator) {
  constexpr double kTable_z_m = -0.0826;
  constexpr double kNoise_m = 0.005;
  const double size_m = object.shape == "ball" ? 0.06 : object.shape == "cube" ? 0.05 : 0.08;
  VisionParameters seen;
  seen.p_RootObject_m = {uniform(generator, -0.6, -0.2), uniform(generator, -0.3, 0.3),
                         kTable_z_m + size_m / 2 + uniform(generator, -kNoise_m, kNoise_m)};
  seen.width_m = size_m * uniform(generator, 0.85, 1.4);  // a cube's extent depends on its turn
  seen.height_m = size_m * uniform(generator, 0.85, 1.15);
  seen.colour = object.colour;
  seen.shape = object.shape;
  return seen;
}

double accuracy(const learning::Mlp& network, const learning::Patterns& patterns) {
  if (patterns.count() == 0) return 0.0;
  int right = 0;
  for (Eigen::Index i = 0; i < patterns.count(); ++i) {
    Eigen::Index chosen = 0;
    Eigen::Index wanted = 0;
    network.forward(patterns.inputs.col(i)).maxCoeff(&chosen);
    patterns.targets.col(i).maxCoeff(&wanted);
    right += chosen == wanted ? 1 : 0;
  }
  return static_cast<double>(right) / static_cast<double>(patterns.count());
}

}  // namespace

learning::Patterns goal_patterns(const GoalCode& code, const std::vector<std::size_t>& phrases,
                                 std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  learning::Patterns patterns;
  const auto count = static_cast<Eigen::Index>(phrases.size());
  patterns.inputs.resize(code.input_size(), count);
  patterns.targets = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(kActionCount), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::size_t index = phrases[static_cast<std::size_t>(i)];
    const Phrase& phrase = code.book().phrases[index];
    patterns.inputs.col(i) = code.encode(show(code.book().object_of(phrase), generator), index);
    patterns.targets(static_cast<Eigen::Index>(action_of(phrase.verb)), i) = 1.0;
  }
  return patterns;
}

GoalTraining train_goal_network(const GoalCode& code, const GoalTrainingOptions& options) {
  // which pairs are learned, which are kept for the test
  std::mt19937_64 generator(options.seed);
  std::vector<std::size_t> all(code.book().phrases.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<std::size_t> shuffled = all;
  for (std::size_t i = shuffled.size(); i > 1; --i) {
    std::swap(shuffled[i - 1], shuffled[generator() % i]);
  }
  const auto held = static_cast<std::ptrdiff_t>(std::min(options.held_out, all.size() - 1));
  const std::vector<std::size_t> held_out(shuffled.begin(), shuffled.begin() + held);
  std::vector<std::size_t> learned(shuffled.begin() + held, shuffled.end());
  std::sort(learned.begin(), learned.end());

  const learning::Patterns train = goal_patterns(code, learned, generator());
  const learning::Patterns test = goal_patterns(code, all, generator());
  learning::Mlp network =
      learning::Mlp::random(code.input_size(),
                            {{GoalNetwork::kHiddenUnits, learning::Activation::kSigmoid},
                             {static_cast<int>(kActionCount), learning::Activation::kSigmoid}},
                            generator());
  learning::OnlineOptions online;
  online.iterations = options.iterations;
  online.rate = options.rate;
  online.seed = generator();
  online.report_every = std::max(1L, options.iterations / 100);

  GoalTrainingReport report;
  report.curve = learning::train_online(network, train, test, online);
  report.rmse_train = learning::rmse(network, train);
  report.rmse_test = learning::rmse(network, test);
  report.accuracy = accuracy(network, test);
  if (held > 0) {
    report.held_out_accuracy = accuracy(network, goal_patterns(code, held_out, generator()));
  }

  // an object alone, without a word
  learning::Patterns silent = test;
  silent.inputs.bottomRows(code.input_size() - GoalCode::kVisionInputs).setZero();
  silent.targets.setZero();
  silent.targets.row(static_cast<Eigen::Index>(Action::kIdle)).setOnes();
  report.idle_without_speech = accuracy(network, silent);
  return {std::move(network), std::move(report)};
}

}  // namespace nido
