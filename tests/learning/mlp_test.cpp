#include "nido/learning/mlp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "nido/learning/normalisation.h"
#include "nido/learning/training.h"

namespace nido::learning {
namespace {

const std::vector<Mlp::LayerSpec> kMixedLayers = {
    {7, Activation::kTanh}, {6, Activation::kSigmoid}, {3, Activation::kLinear}};

double half_squared_error(const Mlp& network, const Eigen::VectorXd& input, const Eigen::VectorXd& target) {
  return 0.5 * (target - network.forward(input)).squaredNorm();
}

TEST(Mlp, GradientEqualsFiniteDifferencesOfTheError) {
  const Mlp network = Mlp::random(4, kMixedLayers, 11, 0.8);
  const Eigen::Vector4d input(0.3, -0.7, 0.1, 0.9);
  const Eigen::Vector3d target(0.2, -0.4, 1.1);
  const MlpGradient gradient = network.gradient(input, target);
  EXPECT_NEAR(gradient.squared_error, 2.0 * half_squared_error(network, input, target), 1e-14);
  constexpr double kStep = 1e-6;
  for (std::size_t layer = 0; layer < network.layers().size(); ++layer) {
    for (Eigen::Index row = 0; row < gradient.weights[layer].rows(); ++row) {
      for (Eigen::Index col = -1; col < gradient.weights[layer].cols(); ++col) {  // -1: the bias
        const auto moved = [&](double step) {
          std::vector<MlpLayer> layers = network.layers();
          (col < 0 ? layers[layer].bias(row) : layers[layer].weights(row, col)) += step;
          return half_squared_error(Mlp::from_layers(layers).value(), input, target);
        };
        const double numeric = (moved(kStep) - moved(-kStep)) / (2.0 * kStep);
        const double exact = col < 0 ? gradient.bias[layer](row) : gradient.weights[layer](row, col);
        EXPECT_NEAR(exact, numeric, 1e-8) << "layer " << layer << " row " << row << " col " << col;
      }
    }
  }
}

TEST(Mlp, JacobianEqualsFiniteDifferencesOfTheOutput) {
  const Mlp network = Mlp::random(4, kMixedLayers, 12, 0.8);
  const Eigen::Vector4d input(0.3, -0.7, 0.1, 0.9);
  const Eigen::MatrixXd jacobian = network.jacobian(input);
  ASSERT_EQ(jacobian.rows(), 3);
  ASSERT_EQ(jacobian.cols(), 4);
  constexpr double kStep = 1e-6;
  for (Eigen::Index i = 0; i < 4; ++i) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(4, i);
    const Eigen::VectorXd numeric =
        (network.forward(input + step) - network.forward(input - step)) / (2.0 * kStep);
    EXPECT_LT((jacobian.col(i) - numeric).norm(), 1e-8);
  }
}

TEST(Mlp, OneOnlineStepGoesDownTheGradientByTheRate) {
  Mlp network = Mlp::random(2, {{3, Activation::kSigmoid}, {1, Activation::kSigmoid}}, 3);
  const Mlp before = network;
  const Eigen::Vector2d input(0.2, 0.8);
  const Eigen::VectorXd target = Eigen::VectorXd::Constant(1, 0.9);
  const MlpGradient gradient = before.gradient(input, target);
  network.train_pattern(input, target, 0.05);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_TRUE(
        network.layers()[i].weights.isApprox(before.layers()[i].weights - 0.05 * gradient.weights[i]));
    EXPECT_TRUE(network.layers()[i].bias.isApprox(before.layers()[i].bias - 0.05 * gradient.bias[i]));
  }
}

TEST(Mlp, LearnsExclusiveOrWithOnlineBackPropagation) {
  Patterns patterns;
  patterns.inputs = Eigen::MatrixXd(2, 4);
  patterns.inputs << 0, 0, 1, 1, 0, 1, 0, 1;
  patterns.targets = Eigen::MatrixXd(1, 4);
  patterns.targets << 0, 1, 1, 0;
  Mlp network = Mlp::random(2, {{4, Activation::kSigmoid}, {1, Activation::kSigmoid}}, 5, 1.0);
  EXPECT_GT(rmse(network, patterns), 0.4);
  const auto curve = train_online(network, patterns, patterns, {.iterations = 40000, .rate = 0.5, .seed = 2});
  EXPECT_LT(rmse(network, patterns), 0.1);
  EXPECT_DOUBLE_EQ(curve.back().train_rmse, rmse(network, patterns));
  EXPECT_EQ(curve.back().iteration, 40000);
}

TEST(Mlp, AdamFitsASmoothFunctionAndGeneralises) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> draw(-1.0, 1.0);
  const auto make = [&](Eigen::Index count) {
    Patterns patterns{Eigen::MatrixXd(2, count), Eigen::MatrixXd(1, count)};
    for (Eigen::Index i = 0; i < count; ++i) {
      const double x = draw(random);
      const double y = draw(random);
      patterns.inputs.col(i) << x, y;
      patterns.targets(0, i) = std::sin(2.0 * x) * y;
    }
    return patterns;
  };
  const Patterns train = make(400);
  const Patterns test = make(200);
  Mlp network = Mlp::random(2, {{16, Activation::kTanh}, {1, Activation::kLinear}}, 6);
  const double before = rmse(network, test);
  train_adam(network, train, test, {.epochs = 400, .batch = 16, .rate = 1e-2, .final_rate = 1e-4});
  EXPECT_GT(before, 0.2);
  EXPECT_LT(rmse(network, test), 0.02);
}

TEST(Mlp, TheSeedDecidesTheWeights) {
  const auto first = [](std::uint64_t seed) {
    return Mlp::random(3, {{10, Activation::kSigmoid}}, seed).layers()[0].weights;
  };
  EXPECT_EQ(first(1), first(1));
  EXPECT_NE(first(1), first(2));
}

TEST(Mlp, LayersThatDoNotFitAreRefused) {
  MlpLayer wide{Eigen::MatrixXd::Ones(3, 2), Eigen::VectorXd::Ones(3), Activation::kSigmoid};
  MlpLayer narrow{Eigen::MatrixXd::Ones(1, 2), Eigen::VectorXd::Ones(1), Activation::kSigmoid};
  EXPECT_FALSE(Mlp::from_layers({}).ok());
  EXPECT_FALSE(Mlp::from_layers({wide, narrow}).ok());
  EXPECT_TRUE(Mlp::from_layers({wide}).ok());
  wide.bias(1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(Mlp::from_layers({wide}).ok());
}

TEST(MinMax, MapsItsRangeToTheUnitRangeAndBack) {
  const auto scale = MinMax::from_range(Eigen::Vector2d(-1.0, 2.0), Eigen::Vector2d(1.0, 6.0));
  ASSERT_TRUE(scale.ok());
  EXPECT_TRUE(scale->to_unit(Eigen::Vector2d(0.0, 6.0)).isApprox(Eigen::Vector2d(0.5, 1.0)));
  EXPECT_TRUE(scale->from_unit(Eigen::Vector2d(0.5, 1.0)).isApprox(Eigen::Vector2d(0.0, 6.0)));
  EXPECT_FALSE(MinMax::from_range(Eigen::Vector2d(0.0, 1.0), Eigen::Vector2d(1.0, 1.0)).ok());
  EXPECT_FALSE(MinMax::from_samples(Eigen::MatrixXd(2, 0)).ok());
}

}  // namespace
}  // namespace nido::learning
