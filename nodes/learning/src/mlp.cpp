#include "nido/learning/mlp.h"

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <random>
#include <sstream>

namespace nido::learning {
namespace {

void require(bool condition, const char* what) {
  if (!condition) {
    std::cerr << "bug: neural network: " << what << '\n';
    std::abort();
  }
}

Eigen::VectorXd activate(const Eigen::VectorXd& net, Activation activation) {
  switch (activation) {
    case Activation::kSigmoid:
      return (1.0 + (-net.array()).exp()).inverse().matrix();
    case Activation::kTanh:
      return net.array().tanh().matrix();
    case Activation::kLinear:
      break;
  }
  return net;
}

// d activation / d net input, from the activation itself
Eigen::ArrayXd slope(const Eigen::VectorXd& output, Activation activation) {
  switch (activation) {
    case Activation::kSigmoid:
      return output.array() * (1.0 - output.array());
    case Activation::kTanh:
      return 1.0 - output.array().square();
    case Activation::kLinear:
      break;
  }
  return Eigen::ArrayXd::Ones(output.size());
}

const char* name_of(Activation activation) {
  switch (activation) {
    case Activation::kSigmoid:
      return "sigmoid";
    case Activation::kTanh:
      return "tanh";
    case Activation::kLinear:
      break;
  }
  return "linear";
}

Result<Activation> activation_named(const std::string& name) {
  for (const Activation activation : {Activation::kSigmoid, Activation::kTanh, Activation::kLinear}) {
    if (name == name_of(activation)) return activation;
  }
  return Error{ErrorCode::kInvalidArgument,
               "activation '" + name + "' is unknown; allowed: sigmoid, tanh, linear"};
}

}  // namespace

Mlp Mlp::random(int inputs, const std::vector<LayerSpec>& layers, std::uint64_t seed, double range) {
  require(inputs > 0 && !layers.empty(), "a network needs inputs and at least one layer");
  std::mt19937_64 generator(seed);
  std::vector<MlpLayer> made;
  int fan_in = inputs;
  for (const LayerSpec& spec : layers) {
    require(spec.units > 0, "a layer needs units");
    const double bound = range > 0.0 ? range : 1.0 / std::sqrt(static_cast<double>(fan_in));
    std::uniform_real_distribution<double> draw(-bound, bound);
    MlpLayer layer{Eigen::MatrixXd(spec.units, fan_in), Eigen::VectorXd(spec.units), spec.activation};
    for (Eigen::Index row = 0; row < layer.weights.rows(); ++row) {
      for (Eigen::Index col = 0; col < layer.weights.cols(); ++col) layer.weights(row, col) = draw(generator);
      layer.bias(row) = draw(generator);
    }
    made.push_back(std::move(layer));
    fan_in = spec.units;
  }
  return Mlp(std::move(made));
}

Result<Mlp> Mlp::from_layers(std::vector<MlpLayer> layers) {
  if (layers.empty()) return Error{ErrorCode::kInvalidArgument, "a network needs at least one layer"};
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const MlpLayer& layer = layers[i];
    const std::string where = "layer " + std::to_string(i) + " ";
    if (layer.weights.size() == 0 || layer.bias.size() != layer.weights.rows()) {
      return Error{ErrorCode::kInvalidArgument, where + "has " + std::to_string(layer.weights.rows()) +
                                                    " x " + std::to_string(layer.weights.cols()) +
                                                    " weights and " + std::to_string(layer.bias.size()) +
                                                    " biases"};
    }
    if (i > 0 && layer.weights.cols() != layers[i - 1].weights.rows()) {
      return Error{ErrorCode::kInvalidArgument, where + "takes " + std::to_string(layer.weights.cols()) +
                                                    " inputs, the layer before gives " +
                                                    std::to_string(layers[i - 1].weights.rows())};
    }
    if (!layer.weights.allFinite() || !layer.bias.allFinite()) {
      return Error{ErrorCode::kInvalidArgument, where + "has a number that is not finite"};
    }
  }
  return Mlp(std::move(layers));
}

Result<Mlp> Mlp::read_from(const WeightsFile& file, const std::string& name) {
  const auto note = file.notes.find(name);
  if (note == file.notes.end()) {
    return Error{ErrorCode::kInvalidArgument, "no network '" + name + "' among the weights (note missing)"};
  }
  std::istringstream words(note->second);
  std::vector<MlpLayer> layers;
  std::string word;
  while (words >> word) {
    auto activation = activation_named(word);
    if (!activation)
      return Error{ErrorCode::kInvalidArgument, "network '" + name + "': " + activation.error().message};
    const std::string prefix = name + "." + std::to_string(layers.size());
    auto weights = file.matrix(prefix + ".weights", -1, -1);
    if (!weights) return weights.error();
    auto bias = file.matrix(prefix + ".bias", weights->rows(), 1);
    if (!bias) return bias.error();
    layers.push_back({std::move(*weights), bias->col(0), *activation});
  }
  auto network = from_layers(std::move(layers));
  if (!network) return Error{network.error().code, "network '" + name + "': " + network.error().message};
  return network;
}

void Mlp::write_to(WeightsFile& file, const std::string& name) const {
  std::string activations;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const std::string prefix = name + "." + std::to_string(i);
    file.matrices[prefix + ".weights"] = layers_[i].weights;
    file.matrices[prefix + ".bias"] = layers_[i].bias;
    activations += (i > 0 ? " " : "") + std::string(name_of(layers_[i].activation));
  }
  file.notes[name] = activations;
}

int Mlp::input_size() const { return static_cast<int>(layers_.front().weights.cols()); }
int Mlp::output_size() const { return static_cast<int>(layers_.back().weights.rows()); }

Eigen::VectorXd Mlp::forward(const Eigen::VectorXd& input) const {
  require(input.size() == input_size(), "input of a wrong size");
  Eigen::VectorXd value = input;
  for (const MlpLayer& layer : layers_)
    value = activate(layer.weights * value + layer.bias, layer.activation);
  return value;
}

std::vector<Eigen::VectorXd> Mlp::activities(const Eigen::VectorXd& input) const {
  require(input.size() == input_size(), "input of a wrong size");
  std::vector<Eigen::VectorXd> values{input};
  values.reserve(layers_.size() + 1);
  for (const MlpLayer& layer : layers_) {
    values.push_back(activate(layer.weights * values.back() + layer.bias, layer.activation));
  }
  return values;
}

Eigen::MatrixXd Mlp::jacobian(const Eigen::VectorXd& input) const {
  const std::vector<Eigen::VectorXd> values = activities(input);
  Eigen::MatrixXd product = Eigen::MatrixXd::Identity(input.size(), input.size());
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const Eigen::ArrayXd derivative = slope(values[i + 1], layers_[i].activation);
    product = derivative.matrix().asDiagonal() * (layers_[i].weights * product);
  }
  return product;
}

MlpGradient Mlp::gradient(const Eigen::VectorXd& input, const Eigen::VectorXd& target) const {
  require(target.size() == output_size(), "target of a wrong size");
  const std::vector<Eigen::VectorXd> values = activities(input);
  const Eigen::VectorXd error = target - values.back();
  const Eigen::VectorXd delta = (error.array() * slope(values.back(), layers_.back().activation)).matrix();
  MlpGradient gradient = gradient_from_output_delta(values, delta);
  gradient.squared_error = error.squaredNorm();
  return gradient;
}

MlpGradient Mlp::gradient_from_output_delta(const std::vector<Eigen::VectorXd>& activities,
                                            const Eigen::VectorXd& output_delta) const {
  require(activities.size() == layers_.size() + 1, "activities of another network");
  require(output_delta.size() == output_size(), "output error of a wrong size");
  MlpGradient gradient;
  gradient.weights.resize(layers_.size());
  gradient.bias.resize(layers_.size());
  Eigen::VectorXd delta = output_delta;
  for (std::size_t i = layers_.size(); i-- > 0;) {
    gradient.weights[i] = -delta * activities[i].transpose();
    gradient.bias[i] = -delta;
    if (i > 0) {
      delta =
          ((layers_[i].weights.transpose() * delta).array() * slope(activities[i], layers_[i - 1].activation))
              .matrix();
    }
  }
  return gradient;
}

void Mlp::add(const MlpGradient& direction, double step) {
  require(direction.weights.size() == layers_.size(), "gradient of another network");
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    layers_[i].weights += step * direction.weights[i];
    layers_[i].bias += step * direction.bias[i];
  }
}

double Mlp::train_pattern(const Eigen::VectorXd& input, const Eigen::VectorXd& target, double rate) {
  const MlpGradient step = gradient(input, target);
  add(step, -rate);
  return step.squared_error;
}

}  // namespace nido::learning
