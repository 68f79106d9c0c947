#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/learning/mlp.h"
#include "nido/learning/normalisation.h"
#include "nido/learning/training.h"
#include "nido/learning/weights_file.h"
#include "nido/reach/seen_hand.h"

namespace nido::reach {

// The paper's reaching network: 3 inputs (where the hand is to be seen), 10 hidden units, 5 outputs (shoulder
// pitch, roll, yaw, elbow, wrist pronosupination), all sigmoid, positions and angles normalised to 0..1.
// Trained by back-propagation on motor babbling. It gives the first posture of a reach. A value,
// thread-compatible.
class PostureNetwork {
 public:
  static constexpr int kOutputs = 5;  // the arm's first five joints
  using Posture = Eigen::Matrix<double, kOutputs, 1>;

  static Result<PostureNetwork> read_from(const learning::WeightsFile& file);
  void write_to(learning::WeightsFile& file) const;

  struct TrainingReport {
    std::vector<learning::CurvePoint> curve;  // normalised RMSE by iteration
    double rmse_train = 0.0;
    double rmse_test = 0.0;
    Eigen::VectorXd rmse_joint;    // test set, normalised, by joint
    Eigen::MatrixXd test_targets;  // normalised, one test sample a column
    Eigen::MatrixXd test_outputs;  // what the network says to it
  };
  // What the paper's "iteration" is, it does not say.
  enum class Iteration {
    kPass,     // every learned pattern once, in a new order
    kPattern,  // one pattern
  };
  // Learns from the first half of the samples and tests on the second, as the paper does. `options` hold the
  // paper's 50 000 iterations and rate 0.05. Angles are normalised by the joints' limits. `on_point` hears of
  // every point of the curve; if it says false, passes end there. kFailed when the training diverges (a rate
  // far too large).
  static Result<PostureNetwork> train(const ArmChain& chain, const std::vector<BabblingSample>& samples,
                                      const learning::OnlineOptions& options,
                                      Iteration iteration = Iteration::kPass,
                                      TrainingReport* report = nullptr,
                                      const std::function<bool(const learning::CurvePoint&)>& on_point = {});

  // Angles for a hand position (root frame), within the joints' limits.
  [[nodiscard]] Posture posture_rad(const Eigen::Vector3d& p_Root_m) const;

 private:
  PostureNetwork(learning::Mlp network, learning::MinMax position, learning::MinMax angle)
      : network_(std::move(network)), position_(std::move(position)), angle_(std::move(angle)) {}
  learning::Mlp network_;
  learning::MinMax position_;
  learning::MinMax angle_;
};

}  // namespace nido::reach
