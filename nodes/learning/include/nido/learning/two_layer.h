#pragma once

#include <Eigen/Core>

#include "nido/learning/mlp.h"

namespace nido::learning {

// A network of two sigmoid layers whose sizes the compiler knows, for long on-line training: the arithmetic
// of Mlp::train_pattern() without its memory allocations, about ten times as fast. A value,
// thread-compatible.
template <int kInputs, int kHidden, int kOutputs>
class TwoLayerSigmoid {
 public:
  using Input = Eigen::Matrix<double, kInputs, 1>;
  using Output = Eigen::Array<double, kOutputs, 1>;

  // From a network of two sigmoid layers of these sizes (anything else is a bug).
  explicit TwoLayerSigmoid(const Mlp& network)
      : hidden_weights_(network.layers().at(0).weights),
        hidden_bias_(network.layers().at(0).bias),
        output_weights_(network.layers().at(1).weights),
        output_bias_(network.layers().at(1).bias) {}

  // weights -= rate * gradient of 1/2 |target - output|^2 at this pattern.
  void train_pattern(const Input& input, const Output& target, double rate) {
    const Hidden hidden = sigmoid<kHidden>((hidden_weights_ * input + hidden_bias_).array());
    const Output output = sigmoid<kOutputs>((output_weights_ * hidden.matrix() + output_bias_).array());
    const Output output_delta = rate * (target - output) * output * (1.0 - output);
    const Hidden hidden_delta =
        (output_weights_.transpose() * output_delta.matrix()).array() * hidden * (1.0 - hidden);
    output_weights_.noalias() += output_delta.matrix() * hidden.matrix().transpose();
    output_bias_ += output_delta.matrix();
    hidden_weights_.noalias() += hidden_delta.matrix() * input.transpose();
    hidden_bias_ += hidden_delta.matrix();
  }

  // Any network again. The weights of a diverged training are not finite: an error.
  [[nodiscard]] Result<Mlp> network() const {
    return Mlp::from_layers({{hidden_weights_, hidden_bias_, Activation::kSigmoid},
                             {output_weights_, output_bias_, Activation::kSigmoid}});
  }

 private:
  using Hidden = Eigen::Array<double, kHidden, 1>;
  template <int kUnits>
  static Eigen::Array<double, kUnits, 1> sigmoid(const Eigen::Array<double, kUnits, 1>& net) {
    return (1.0 + (-net).exp()).inverse();
  }
  Eigen::Matrix<double, kHidden, kInputs> hidden_weights_;
  Eigen::Matrix<double, kHidden, 1> hidden_bias_;
  Eigen::Matrix<double, kOutputs, kHidden> output_weights_;
  Eigen::Matrix<double, kOutputs, 1> output_bias_;
};

}  // namespace nido::learning
