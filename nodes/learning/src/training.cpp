#include "nido/learning/training.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace nido::learning {
namespace {

std::vector<Eigen::Index> in_order(Eigen::Index count) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  return order;
}

Eigen::VectorXd mean_squared_error(const Mlp& network, const Patterns& patterns) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(network.output_size());
  for (Eigen::Index i = 0; i < patterns.count(); ++i) {
    sum += (patterns.targets.col(i) - network.forward(patterns.inputs.col(i))).cwiseAbs2();
  }
  return patterns.count() == 0 ? sum : Eigen::VectorXd(sum / static_cast<double>(patterns.count()));
}

// First and second moments of one parameter block.
template <class Block>
struct Moments {
  explicit Moments(const Block& like)
      : first(Block::Zero(like.rows(), like.cols())), second(Block::Zero(like.rows(), like.cols())) {}
  // Adam's bias-corrected direction for this gradient.
  Block direction(const Block& gradient, long step) {
    constexpr double kBeta1 = 0.9;
    constexpr double kBeta2 = 0.999;
    first = kBeta1 * first + (1.0 - kBeta1) * gradient;
    second = kBeta2 * second + (1.0 - kBeta2) * gradient.cwiseAbs2();
    const double correction1 = 1.0 - std::pow(kBeta1, static_cast<double>(step));
    const double correction2 = 1.0 - std::pow(kBeta2, static_cast<double>(step));
    return ((first.array() / correction1) / ((second.array() / correction2).sqrt() + 1e-8)).matrix();
  }
  Block first;
  Block second;
};

void accumulate(MlpGradient& sum, const MlpGradient& part) {
  if (sum.weights.empty()) {
    sum = part;
    return;
  }
  for (std::size_t i = 0; i < sum.weights.size(); ++i) {
    sum.weights[i] += part.weights[i];
    sum.bias[i] += part.bias[i];
  }
}

}  // namespace

double rmse(const Mlp& network, const Patterns& patterns) {
  return std::sqrt(mean_squared_error(network, patterns).mean());
}

Eigen::VectorXd rmse_per_output(const Mlp& network, const Patterns& patterns) {
  return mean_squared_error(network, patterns).cwiseSqrt();
}

std::vector<CurvePoint> train_online(Mlp& network, const Patterns& train, const Patterns& test,
                                     const OnlineOptions& options,
                                     const std::function<void(const CurvePoint&)>& on_point) {
  std::vector<CurvePoint> curve;
  const auto report = [&](long iteration) {
    curve.push_back({iteration, rmse(network, train), rmse(network, test)});
    if (on_point) on_point(curve.back());
  };
  report(0);
  if (train.count() == 0) return curve;
  std::mt19937_64 generator(options.seed);
  std::vector<Eigen::Index> order = in_order(train.count());
  std::size_t next = order.size();
  for (long iteration = 1; iteration <= options.iterations; ++iteration) {
    if (next == order.size()) {
      std::shuffle(order.begin(), order.end(), generator);
      next = 0;
    }
    const Eigen::Index pattern = order[next++];
    network.train_pattern(train.inputs.col(pattern), train.targets.col(pattern), options.rate);
    if (iteration % std::max(1L, options.report_every) == 0 || iteration == options.iterations)
      report(iteration);
  }
  return curve;
}

std::vector<CurvePoint> train_adam(Mlp& network, const Patterns& train, const Patterns& test,
                                   const AdamOptions& options,
                                   const std::function<void(const CurvePoint&)>& on_point) {
  std::vector<CurvePoint> curve;
  if (train.count() == 0) return curve;
  std::mt19937_64 generator(options.seed);
  std::vector<Eigen::Index> order = in_order(train.count());
  std::vector<Moments<Eigen::MatrixXd>> weight_moments;
  std::vector<Moments<Eigen::VectorXd>> bias_moments;
  for (const MlpLayer& layer : network.layers()) {
    weight_moments.emplace_back(layer.weights);
    bias_moments.emplace_back(layer.bias);
  }
  const auto batch = static_cast<std::size_t>(std::max(1, options.batch));
  const double decay = std::pow(options.final_rate / options.rate, 1.0 / std::max(1, options.epochs - 1));
  double rate = options.rate;
  long step = 0;
  for (int epoch = 1; epoch <= options.epochs; ++epoch, rate *= decay) {
    std::shuffle(order.begin(), order.end(), generator);
    for (std::size_t begin = 0; begin < order.size(); begin += batch) {
      const std::size_t end = std::min(order.size(), begin + batch);
      MlpGradient sum;
      for (std::size_t i = begin; i < end; ++i) {
        accumulate(sum, network.gradient(train.inputs.col(order[i]), train.targets.col(order[i])));
      }
      ++step;
      const double share = 1.0 / static_cast<double>(end - begin);
      for (std::size_t layer = 0; layer < sum.weights.size(); ++layer) {
        sum.weights[layer] = weight_moments[layer].direction(share * sum.weights[layer], step) +
                             options.weight_decay * network.layers()[layer].weights;
        sum.bias[layer] = bias_moments[layer].direction(share * sum.bias[layer], step);
      }
      network.add(sum, -rate);
    }
    if (epoch == options.epochs || epoch % 10 == 0 || epoch == 1) {
      curve.push_back({epoch, rmse(network, train), rmse(network, test)});
      if (on_point) on_point(curve.back());
    }
  }
  return curve;
}

}  // namespace nido::learning
