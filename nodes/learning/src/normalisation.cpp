#include "nido/learning/normalisation.h"

namespace nido::learning {

Result<MinMax> MinMax::from_range(const Eigen::VectorXd& min, const Eigen::VectorXd& max) {
  if (min.size() != max.size() || min.size() == 0) {
    return Error{ErrorCode::kInvalidArgument, "normalisation: " + std::to_string(min.size()) + " lower and " +
                                                  std::to_string(max.size()) + " upper bounds"};
  }
  for (Eigen::Index i = 0; i < min.size(); ++i) {
    const double range = max(i) - min(i);
    if (!(range > 0.0) || !(range < 1e300)) {
      return Error{ErrorCode::kInvalidArgument, "normalisation: component " + std::to_string(i) +
                                                    " ranges from " + std::to_string(min(i)) + " to " +
                                                    std::to_string(max(i)) +
                                                    ", expected finite numbers and the second larger"};
    }
  }
  return MinMax(min, max - min);
}

Result<MinMax> MinMax::from_samples(const Eigen::MatrixXd& samples) {
  if (samples.cols() == 0) return Error{ErrorCode::kInvalidArgument, "normalisation: no samples"};
  return from_range(samples.rowwise().minCoeff(), samples.rowwise().maxCoeff());
}

Result<MinMax> MinMax::read_from(const WeightsFile& file, const std::string& name) {
  auto min = file.matrix(name + ".min", -1, 1);
  if (!min) return min.error();
  auto range = file.matrix(name + ".range", min->rows(), 1);
  if (!range) return range.error();
  if (!(range->minCoeff() > 0.0)) {
    return Error{ErrorCode::kInvalidArgument, "normalisation '" + name + "': a range is not positive"};
  }
  return MinMax(min->col(0), range->col(0));
}

void MinMax::write_to(WeightsFile& file, const std::string& name) const {
  file.matrices[name + ".min"] = min_;
  file.matrices[name + ".range"] = range_;
}

Eigen::VectorXd MinMax::to_unit(const Eigen::VectorXd& value) const {
  return ((value - min_).array() / range_.array()).matrix();
}

Eigen::VectorXd MinMax::from_unit(const Eigen::VectorXd& unit) const {
  return (unit.array() * range_.array()).matrix() + min_;
}

}  // namespace nido::learning
