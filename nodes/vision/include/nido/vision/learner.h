#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/vision/object_tracker.h"
#include "nido/vision/templates.h"

namespace nido::vision {

// Learns how a thing looks that somebody shows: it is held or lies in the middle of the left picture, and has
// a colour that parts it from what is around. Colour, shape and size come from the pictures and the
// kinematics alone. One thing, one thread.
class Learner {
 public:
  static constexpr int kViews = 6;  // pairs of pictures that are learned from

  // `known`: what vision knows already; kept as a copy.
  Learner(std::string name, const TemplateSet& known);

  // Looks at one pair of pictures (its blobs are not used). A sentence when the thing cannot be made out in
  // it: that pair is left out.
  Status view(const StereoBlobs& pictures);
  [[nodiscard]] int views() const { return static_cast<int>(outlines_.size()); }

  // What it looks like. kFailed, with a sentence, before the first good view, or when no simple body explains
  // what was seen.
  struct Learned {
    std::optional<ColourModel> colour;  // when it is one that vision did not know
    ObjectTemplate object;
    double overlap = 0;  // of the body with what was seen, 0..1
  };
  [[nodiscard]] Result<Learned> learned() const;

 private:
  struct Outlines {
    EyePair eyes;
    OutlinePair seen;
    Eigen::Vector3d p_Root_m;
  };
  Status choose_colour(const Image& left);

  std::string name_;
  TemplateSet known_;
  int colour_ = -1;          // index into known_.colours, the new one included
  bool new_colour_ = false;  // the last of known_.colours was learned here
  std::vector<Outlines> outlines_;
  std::vector<Patch> patches_;
};

}  // namespace nido::vision
