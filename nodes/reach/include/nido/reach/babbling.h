#pragma once

#include <filesystem>
#include <optional>
#include <random>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/reach/arm_chain.h"
#include "nido/reach/joint_path.h"
#include "nido/reach/posture_drawer.h"
#include "nido/reach/posture_history.h"
#include "nido/reach/reach_core.h"
#include "nido/reach/seen_hand.h"

namespace nido::reach {

struct BabblingOptions {
  int samples = 5000;          // sightings to gather
  std::string side = "right";  // of the chain
  bool whole_body = false;     // false: the paper's five arm joints; true: torso and wrist as well
  // Brisk, below the arm's 1.75 rad/s: what a sample costs is the time until the next picture shows another
  // posture.
  Joints speed_rad_s = Joints::Constant(1.6);
  double spacing_rad = 0.02;  // a new sample differs so much in some joint from the last one
  std::uint64_t seed = 1;
};

// Motor babbling: random postures one after another, and for every sighting of the hand's mark the posture
// the body had at the time of the image. Thread-compatible.
class Babbling {
 public:
  Babbling(const ArmChain& chain, const BabblingOptions& options);

  // One tick. The commanded joints, or nothing before the first encoders and when the samples are complete.
  std::optional<Joints> step(double now_s, const std::optional<Joints>& measured_rad,
                             const std::optional<HandSighting>& hand);
  [[nodiscard]] const std::vector<BabblingSample>& samples() const { return samples_; }
  [[nodiscard]] bool complete() const { return static_cast<int>(samples_.size()) >= options_.samples; }

 private:
  void start_move(double now_s);
  [[nodiscard]] double move_duration_s() const;
  [[nodiscard]] Joints on_way(double t_s) const;

  PostureDrawer drawer_;
  BabblingOptions options_;
  std::mt19937_64 random_;
  std::vector<BabblingSample> samples_;
  PostureHistory history_;
  std::optional<Joints> command_;
  JointPath path_;
  double move_begin_s_ = 0.0;
};

// Samples as a text file (a weights file with the matrix "samples": ten joints in rad, then the mark's x, y,
// z in m).
Status save_samples(const std::filesystem::path& path, const std::vector<BabblingSample>& samples,
                    const std::string& command);
Result<std::vector<BabblingSample>> load_samples(const std::filesystem::path& path);

}  // namespace nido::reach
