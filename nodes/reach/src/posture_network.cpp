#include "nido/reach/posture_network.h"

#include <algorithm>
#include <numeric>
#include <random>

#include "nido/learning/two_layer.h"

namespace nido::reach {
namespace {

constexpr int kHidden = 10;

// On-line back-propagation by whole passes: 50 000 of them over 2 500 patterns are 125 million steps.
Status train_passes(learning::Mlp& network, const learning::Patterns& train, const learning::Patterns& test,
                    const learning::OnlineOptions& options, std::vector<learning::CurvePoint>& curve,
                    const std::function<bool(const learning::CurvePoint&)>& on_point) {
  learning::TwoLayerSigmoid<3, kHidden, PostureNetwork::kOutputs> fast(network);
  std::vector<Eigen::Index> order(static_cast<std::size_t>(train.count()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::mt19937_64 generator(options.seed);
  const auto report = [&](long pass) {
    curve.push_back({pass, learning::rmse(network, train), learning::rmse(network, test)});
    return !on_point || on_point(curve.back());
  };
  if (!report(0)) return {};
  for (long pass = 1; pass <= options.iterations; ++pass) {
    std::shuffle(order.begin(), order.end(), generator);
    for (const Eigen::Index pattern : order) {
      fast.train_pattern(train.inputs.col(pattern), train.targets.col(pattern).array(), options.rate);
    }
    if (pass % std::max(1L, options.report_every) != 0 && pass != options.iterations) continue;
    auto trained = fast.network();
    if (!trained) return Error{ErrorCode::kFailed, "the training diverged: " + trained.error().message};
    network = std::move(*trained);
    if (!report(pass)) break;
  }
  return {};
}

}  // namespace

Result<PostureNetwork> PostureNetwork::read_from(const learning::WeightsFile& file) {
  auto network = learning::Mlp::read_from(file, "posture.network");
  if (!network) return network.error();
  auto position = learning::MinMax::read_from(file, "posture.position");
  if (!position) return position.error();
  auto angle = learning::MinMax::read_from(file, "posture.angle");
  if (!angle) return angle.error();
  if (network->input_size() != 3 || network->output_size() != kOutputs || position->size() != 3 ||
      angle->size() != kOutputs) {
    return Error{ErrorCode::kInvalidArgument,
                 "network 'posture.network' maps " + std::to_string(network->input_size()) + " inputs to " +
                     std::to_string(network->output_size()) + " outputs, expected 3 to 5"};
  }
  return PostureNetwork(std::move(*network), std::move(*position), std::move(*angle));
}

void PostureNetwork::write_to(learning::WeightsFile& file) const {
  network_.write_to(file, "posture.network");
  position_.write_to(file, "posture.position");
  angle_.write_to(file, "posture.angle");
}

Result<PostureNetwork> PostureNetwork::train(
    const ArmChain& chain, const std::vector<BabblingSample>& samples, const learning::OnlineOptions& options,
    Iteration iteration, TrainingReport* report,
    const std::function<bool(const learning::CurvePoint&)>& on_point) {
  const auto count = static_cast<Eigen::Index>(samples.size());
  if (count < 20) {
    return Error{ErrorCode::kInvalidArgument,
                 "babbling gave " + std::to_string(count) + " sightings of the hand, at least 20 are needed"};
  }
  Eigen::MatrixXd positions(3, count);
  Eigen::MatrixXd angles(kOutputs, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    positions.col(i) = samples[static_cast<std::size_t>(i)].p_Root_m;
    angles.col(i) = samples[static_cast<std::size_t>(i)].q.segment<kOutputs>(kTorsoJoints);
  }
  auto position = learning::MinMax::from_samples(positions);
  if (!position) return position.error();
  auto angle = learning::MinMax::from_range(chain.min().segment<kOutputs>(kTorsoJoints),
                                            chain.max().segment<kOutputs>(kTorsoJoints));
  if (!angle) return angle.error();
  for (Eigen::Index i = 0; i < count; ++i) {
    positions.col(i) = position->to_unit(positions.col(i));
    angles.col(i) = angle->to_unit(angles.col(i));
  }
  const Eigen::Index half = count / 2;
  const learning::Patterns train{positions.leftCols(half), angles.leftCols(half)};
  const learning::Patterns test{positions.rightCols(count - half), angles.rightCols(count - half)};
  learning::Mlp network = learning::Mlp::random(
      3, {{kHidden, learning::Activation::kSigmoid}, {kOutputs, learning::Activation::kSigmoid}},
      options.seed);
  std::vector<learning::CurvePoint> curve;
  if (iteration == Iteration::kPattern) {
    curve = learning::train_online(network, train, test, options, [&](const learning::CurvePoint& point) {
      if (on_point) on_point(point);
    });
  } else if (auto trained = train_passes(network, train, test, options, curve, on_point); !trained) {
    return trained.error();
  }
  if (report != nullptr) {
    report->curve = std::move(curve);
    report->rmse_train = learning::rmse(network, train);
    report->rmse_test = learning::rmse(network, test);
    report->rmse_joint = learning::rmse_per_output(network, test);
    report->test_targets = test.targets;
    report->test_outputs.resize(kOutputs, test.count());
    for (Eigen::Index i = 0; i < test.count(); ++i)
      report->test_outputs.col(i) = network.forward(test.inputs.col(i));
  }
  return PostureNetwork(std::move(network), std::move(*position), std::move(*angle));
}

PostureNetwork::Posture PostureNetwork::posture_rad(const Eigen::Vector3d& p_Root_m) const {
  // a goal far outside the babbled space would drive the sigmoid units to their ends: keep it at the space's
  // border
  const Eigen::VectorXd unit = position_.to_unit(p_Root_m).cwiseMax(-0.2).cwiseMin(1.2);
  return angle_.from_unit(network_.forward(unit));
}

}  // namespace nido::reach
