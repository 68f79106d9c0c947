#pragma once

#include <Eigen/Core>
#include <string>

#include "nido/interfaces/result.h"
#include "nido/learning/weights_file.h"

namespace nido::learning {

// Linear map of every component from [min, max] to [0, 1], as the paper normalises positions and joints.
// Values outside the range map outside 0..1 and are not clamped. A value, thread-compatible.
class MinMax {
 public:
  // kInvalidArgument if sizes differ, a number is not finite or a component has max <= min.
  static Result<MinMax> from_range(const Eigen::VectorXd& min, const Eigen::VectorXd& max);
  // Range of the columns of `samples` (one sample a column). kInvalidArgument as above.
  static Result<MinMax> from_samples(const Eigen::MatrixXd& samples);
  static Result<MinMax> read_from(const WeightsFile& file, const std::string& name);
  void write_to(WeightsFile& file, const std::string& name) const;  // "NAME.min", "NAME.range"

  [[nodiscard]] Eigen::Index size() const { return min_.size(); }
  [[nodiscard]] const Eigen::VectorXd& min() const { return min_; }
  [[nodiscard]] const Eigen::VectorXd& range() const { return range_; }
  [[nodiscard]] Eigen::VectorXd to_unit(const Eigen::VectorXd& value) const;
  [[nodiscard]] Eigen::VectorXd from_unit(const Eigen::VectorXd& unit) const;

 private:
  MinMax(Eigen::VectorXd min, Eigen::VectorXd range) : min_(std::move(min)), range_(std::move(range)) {}
  Eigen::VectorXd min_;
  Eigen::VectorXd range_;
};

}  // namespace nido::learning
