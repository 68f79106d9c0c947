#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/learning/weights_file.h"

namespace nido::learning {

enum class Activation { kSigmoid, kTanh, kLinear };

// One layer: output = activation(weights * input + bias).
struct MlpLayer {
  Eigen::MatrixXd weights;  // units x inputs
  Eigen::VectorXd bias;     // units
  Activation activation = Activation::kSigmoid;
};

// Derivative of the error E = 1/2 |target - output|^2 by every weight, shaped as the layers.
struct MlpGradient {
  std::vector<Eigen::MatrixXd> weights;
  std::vector<Eigen::VectorXd> bias;
  double squared_error = 0.0;  // |target - output|^2 before the step
};

// A feed-forward multilayer perceptron and its back-propagation (equations: docs/learning.md). A value: copy
// it to keep a state. Thread-compatible. Vectors of a wrong size are bugs and end the process.
class Mlp {
 public:
  struct LayerSpec {
    int units = 0;
    Activation activation = Activation::kSigmoid;
  };

  // A network with weights and biases drawn evenly from [-range, range]; range 0 stands for 1/sqrt(inputs of
  // the layer).
  static Mlp random(int inputs, const std::vector<LayerSpec>& layers, std::uint64_t seed, double range = 0.0);
  // Takes layers as they are. kInvalidArgument if sizes do not follow each other or a number is not finite.
  static Result<Mlp> from_layers(std::vector<MlpLayer> layers);
  // Reads what write_to() stored under `name`. kInvalidArgument names what is missing or has a wrong shape.
  static Result<Mlp> read_from(const WeightsFile& file, const std::string& name);
  // Stores the layers as "NAME.0.weights", "NAME.0.bias", ... and their activations as the note "NAME".
  void write_to(WeightsFile& file, const std::string& name) const;

  [[nodiscard]] int input_size() const;
  [[nodiscard]] int output_size() const;
  [[nodiscard]] const std::vector<MlpLayer>& layers() const { return layers_; }

  [[nodiscard]] Eigen::VectorXd forward(const Eigen::VectorXd& input) const;
  // Outputs of every layer, the input first, the network's output last.
  [[nodiscard]] std::vector<Eigen::VectorXd> activities(const Eigen::VectorXd& input) const;
  // d output / d input at `input`, outputs x inputs.
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::VectorXd& input) const;

  [[nodiscard]] MlpGradient gradient(const Eigen::VectorXd& input, const Eigen::VectorXd& target) const;
  // The same for an error signal at the output units given as -dE/d(net input of the unit), for rules other
  // than the squared error (reward-penalty). `activities` as returned by activities(); squared_error stays 0.
  [[nodiscard]] MlpGradient gradient_from_output_delta(const std::vector<Eigen::VectorXd>& activities,
                                                       const Eigen::VectorXd& output_delta) const;
  // weights += step * direction, bias likewise. A step of -rate follows the gradient down.
  void add(const MlpGradient& direction, double step);

  // One pattern of on-line back-propagation: weights -= rate * gradient. Returns |target - output|^2 before
  // the step.
  double train_pattern(const Eigen::VectorXd& input, const Eigen::VectorXd& target, double rate);

 private:
  explicit Mlp(std::vector<MlpLayer> layers) : layers_(std::move(layers)) {}
  std::vector<MlpLayer> layers_;
};

}  // namespace nido::learning
