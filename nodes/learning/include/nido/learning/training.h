#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "nido/learning/mlp.h"

namespace nido::learning {

// Patterns: one a column.
struct Patterns {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd targets;
  [[nodiscard]] Eigen::Index count() const { return inputs.cols(); }
};

// Root mean squared error over all patterns and output units; 0 without patterns.
double rmse(const Mlp& network, const Patterns& patterns);
// The same for each output unit.
Eigen::VectorXd rmse_per_output(const Mlp& network, const Patterns& patterns);

struct CurvePoint {
  long iteration = 0;
  double train_rmse = 0.0;
  double test_rmse = 0.0;
};

// On-line back-propagation as in the paper: an iteration presents ONE pattern and changes the weights by rate
// times its gradient. Patterns come in a random order without replacement, shuffled anew after each pass.
struct OnlineOptions {
  long iterations = 50000;
  double rate = 0.05;
  std::uint64_t seed = 1;
  long report_every = 500;  // iterations between points of the curve
};
std::vector<CurvePoint> train_online(Mlp& network, const Patterns& train, const Patterns& test,
                                     const OnlineOptions& options,
                                     const std::function<void(const CurvePoint&)>& on_point = {});

// Mini-batches with Adam (Kingma & Ba 2015), for regression where precision counts.
struct AdamOptions {
  int epochs = 200;
  int batch = 32;
  double rate = 1e-3;
  double final_rate = 1e-5;   // the rate falls to it geometrically
  double weight_decay = 0.0;  // decoupled, per step, times the rate
  std::uint64_t seed = 1;
};
std::vector<CurvePoint> train_adam(Mlp& network, const Patterns& train, const Patterns& test,
                                   const AdamOptions& options,
                                   const std::function<void(const CurvePoint&)>& on_point = {});

}  // namespace nido::learning
