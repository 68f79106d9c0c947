#include "nido/reach/seen_hand.h"

#include <algorithm>
#include <cmath>

namespace nido::reach {
namespace {

// sines and cosines: no jump at any angle, all inputs within -1..1
Eigen::VectorXd features(const Joints& q) {
  Eigen::VectorXd values(2 * kJoints);
  values << q.array().sin().matrix(), q.array().cos().matrix();
  return values;
}

// Best place of the mark in the palm frame: the mean of what was seen, brought into the palm frame.
Eigen::Vector3d mean_mark(const std::vector<Eigen::Vector3d>& marks_Palm_m, const std::vector<bool>& used) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (std::size_t i = 0; i < marks_Palm_m.size(); ++i) {
    if (!used[i]) continue;
    sum += marks_Palm_m[i];
    count += 1.0;
  }
  return count > 0.0 ? Eigen::Vector3d(sum / count) : sum;
}

Eigen::Vector3d median_mark(const std::vector<Eigen::Vector3d>& marks_Palm_m) {
  Eigen::Vector3d median;
  std::vector<double> values(marks_Palm_m.size());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::transform(marks_Palm_m.begin(), marks_Palm_m.end(), values.begin(),
                   [&](const Eigen::Vector3d& p) { return p(axis); });
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    median(axis) = *middle;
  }
  return median;
}

}  // namespace

SeenHandModel::SeenHandModel(const Eigen::Vector3d& p_PalmMark_m) : p_PalmMark_m_(p_PalmMark_m) {}

Result<SeenHandModel> SeenHandModel::read_from(const learning::WeightsFile& file) {
  auto mark = file.matrix("mark.p_PalmMark_m", 3, 1);
  if (!mark) return mark.error();
  SeenHandModel model(mark->col(0));
  auto scale = file.matrix("mark.scale_m", 1, 1);
  if (!scale) return scale.error();
  model.scale_m_ = (*scale)(0, 0);
  auto network = learning::Mlp::read_from(file, "mark.network");
  if (!network) return network.error();
  if (network->input_size() != 2 * kJoints || network->output_size() != 3) {
    return Error{ErrorCode::kInvalidArgument,
                 "network 'mark.network' maps " + std::to_string(network->input_size()) + " inputs to " +
                     std::to_string(network->output_size()) + " outputs, expected 20 to 3"};
  }
  model.network_.push_back(std::move(*network));
  return model;
}

void SeenHandModel::write_to(learning::WeightsFile& file) const {
  file.matrices["mark.p_PalmMark_m"] = p_PalmMark_m_;
  file.matrices["mark.scale_m"] = Eigen::MatrixXd::Constant(1, 1, scale_m_);
  if (!network_.empty()) network_.front().write_to(file, "mark.network");
}

Eigen::Vector3d SeenHandModel::correction_Root_m(const Joints& q) const {
  if (network_.empty()) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d correction = scale_m_ * network_.front().forward(features(q));
  const double length = correction.norm();
  return length > kMostCorrection_m ? Eigen::Vector3d(correction * (kMostCorrection_m / length)) : correction;
}

Eigen::Vector3d SeenHandModel::mark_Root_m(const ArmChain& chain, const Joints& q) const {
  return chain.X_RootPalm(q) * p_PalmMark_m_ + correction_Root_m(q);
}

Result<SeenHandModel> SeenHandModel::train(const ArmChain& chain, const std::vector<BabblingSample>& samples,
                                           const TrainingOptions& options, TrainingReport* report) {
  std::vector<Eigen::Vector3d> marks_Palm_m;
  marks_Palm_m.reserve(samples.size());
  for (const BabblingSample& sample : samples) {
    marks_Palm_m.push_back(chain.X_RootPalm(sample.q).inverse() * sample.p_Root_m);
  }
  if (samples.size() < 100) {
    return Error{ErrorCode::kInvalidArgument, "babbling gave " + std::to_string(samples.size()) +
                                                  " sightings of the hand, at least 100 are needed"};
  }
  const Eigen::Vector3d median = median_mark(marks_Palm_m);
  std::vector<bool> used(samples.size());
  std::size_t used_count = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    used[i] = (marks_Palm_m[i] - median).norm() < options.outlier_m;
    used_count += used[i] ? 1 : 0;
  }
  if (used_count < 100) {
    return Error{ErrorCode::kInvalidArgument, "only " + std::to_string(used_count) + " of " +
                                                  std::to_string(samples.size()) +
                                                  " sightings agree about where the mark is on the hand"};
  }
  const std::size_t half = samples.size() / 2;
  std::vector<bool> fitted = used;
  std::fill(fitted.begin() + static_cast<std::ptrdiff_t>(half), fitted.end(), false);
  SeenHandModel model(mean_mark(marks_Palm_m, fitted));

  learning::Patterns train;
  learning::Patterns test;
  for (learning::Patterns* patterns : {&train, &test}) {
    patterns->inputs.resize(2 * kJoints, static_cast<Eigen::Index>(samples.size()));
    patterns->targets.resize(3, static_cast<Eigen::Index>(samples.size()));
  }
  Eigen::Index trains = 0;
  Eigen::Index tests = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!used[i]) continue;
    learning::Patterns& patterns = i < half ? train : test;
    const Eigen::Index at = i < half ? trains++ : tests++;
    patterns.inputs.col(at) = features(samples[i].q);
    patterns.targets.col(at) =
        (samples[i].p_Root_m - chain.X_RootPalm(samples[i].q) * model.p_PalmMark_m_) / model.scale_m_;
  }
  train.inputs.conservativeResize(Eigen::NoChange, trains);
  train.targets.conservativeResize(Eigen::NoChange, trains);
  test.inputs.conservativeResize(Eigen::NoChange, tests);
  test.targets.conservativeResize(Eigen::NoChange, tests);

  learning::Mlp network = learning::Mlp::random(
      2 * kJoints, {{options.hidden, learning::Activation::kTanh}, {3, learning::Activation::kLinear}},
      options.seed);
  learning::train_adam(network, train, test,
                       {.epochs = options.epochs,
                        .batch = 32,
                        .rate = 5e-3,
                        .final_rate = 5e-5,
                        .weight_decay = 1e-2,
                        .seed = options.seed});
  if (report != nullptr) {
    report->used = used_count;
    report->outliers = samples.size() - used_count;
    const double per_component = model.scale_m_ * std::sqrt(3.0);
    report->prior_rms_m =
        tests > 0
            ? per_component * std::sqrt(test.targets.squaredNorm() / static_cast<double>(test.targets.size()))
            : 0.0;
    report->learned_rms_m = per_component * learning::rmse(network, test);
  }
  model.network_.push_back(std::move(network));
  return model;
}

}  // namespace nido::reach
