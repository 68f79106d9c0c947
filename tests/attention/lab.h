#pragma once

#include <functional>

#include "nido/attention/attention_core.h"
#include "scenes.h"
#include "stage.h"
#include "truth.h"

namespace nido::test {

// What the judge makes of one pair of pictures.
struct Judged {
  double time_s = 0;       // since the scene began
  double fixation_px = 0;  // of the true centre from both pictures' middles, mean
  double overlap = 0;      // of the segment with the true silhouette
  double overlap_threshold = 0;
  double work_s = 0;
};

// Attention with its hands on the simulated head, in one process: pictures every 30 ms, encoders and commands
// every 10 ms. Truth stays here.
class AttentionLab {
 public:
  explicit AttentionLab(const attention::AttentionSettings& settings);
  // Plays a scene; `seen` gets every pair of pictures, with the left one, segment and truth.
  using Seen = std::function<void(const Judged&, const Image& left, const attention::Surface*,
                                  const std::vector<std::uint8_t>& truth)>;
  std::vector<Judged> play(const attention::Scene& scene, double duration_s, const Seen& seen = {});

 private:
  void put(const attention::Placed& placed);
  void park();

  Stage stage_;
  std::unique_ptr<attention::AttentionCore> core_;
  int tick_ = 0;
};

}  // namespace nido::test
