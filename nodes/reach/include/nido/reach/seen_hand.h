#pragma once

#include <Eigen/Geometry>

#include "nido/interfaces/result.h"
#include "nido/learning/mlp.h"
#include "nido/learning/training.h"
#include "nido/learning/weights_file.h"
#include "nido/reach/arm_chain.h"

namespace nido::reach {

// One moment of motor babbling: where the eyes saw the hand's mark and how the body stood.
struct BabblingSample {
  Joints q = Joints::Zero();                           // rad, encoders at the time of the image
  Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();  // the mark as seen
};

// Where will the eyes see the hand when the body stands so? Learned from babbling through the eyes, with the
// body's own geometry as prior (docs/reach.md): the mark's place on the hand is fitted, and a small network
// learns what the eyes see differently from that, by posture. Goals come from the same eyes, so this is the
// space in which hand and object meet. A value, thread-compatible.
class SeenHandModel {
 public:
  // Nothing learned yet: the mark sits at `p_PalmMark_m` and the eyes see what is.
  explicit SeenHandModel(const Eigen::Vector3d& p_PalmMark_m = Eigen::Vector3d::Zero());

  static Result<SeenHandModel> read_from(const learning::WeightsFile& file);
  void write_to(learning::WeightsFile& file) const;

  struct TrainingOptions {
    int hidden = 12;
    int epochs = 150;
    std::uint64_t seed = 1;
    double outlier_m =
        0.05;  // samples farther than this from the fitted mark are wrong sightings and left out
  };
  struct TrainingReport {
    std::size_t used = 0;
    std::size_t outliers = 0;
    double prior_rms_m =
        0.0;  // test set: distance of the seen mark from the prior with the fitted mark place
    double learned_rms_m = 0.0;  // test set: from the whole model
  };
  // Fits to the first half, tests on the second. kInvalidArgument with fewer than 100 samples that agree.
  static Result<SeenHandModel> train(const ArmChain& chain, const std::vector<BabblingSample>& samples,
                                     const TrainingOptions& options, TrainingReport* report = nullptr);

  // The mark as the eyes will see it, root frame.
  [[nodiscard]] Eigen::Vector3d mark_Root_m(const ArmChain& chain, const Joints& q) const;
  // Seen minus real by posture, root frame, at most `kMostCorrection_m` long.
  [[nodiscard]] Eigen::Vector3d correction_Root_m(const Joints& q) const;
  [[nodiscard]] const Eigen::Vector3d& p_PalmMark_m() const { return p_PalmMark_m_; }

  static constexpr double kMostCorrection_m = 0.03;

 private:
  Eigen::Vector3d p_PalmMark_m_;
  std::vector<learning::Mlp> network_;  // one, or none when nothing was learned
  double scale_m_ = 0.01;               // of the network's outputs
};

}  // namespace nido::reach
