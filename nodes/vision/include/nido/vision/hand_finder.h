#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nido/vision/object_tracker.h"

namespace nido::vision {

// The robot's own hand, by the two marks on its back.
struct SeenHand {
  std::string side;                                           // "left", "right"
  bool visible = false;                                       // the knuckle mark is seen by both eyes
  double confidence = 0;                                      // 0..1
  Eigen::Vector3d p_RootKnuckle_m = Eigen::Vector3d::Zero();  // centre of the knuckle mark
  // Both marks are seen. x points from wrist to knuckles; z, out of the back of the hand, is only taken to
  // point to the eyes as far as x allows.
  bool has_orientation = false;
  Eigen::Quaterniond q_RootHand = Eigen::Quaterniond::Identity();
  std::array<std::array<double, 4>, 2> box{};  // around both marks, px
};

struct HandFinderSettings {
  double mark_radius_m = 0.008;
  double marks_apart_m = 0.046;  // centre to centre
  double tolerance_m = 0.012;    // of that distance and of the gap between lines of sight
  double middle_y_m = -0.06;     // a hand that is seen alone is the right one if it is to the right of this
};

// Finds both hands in a pair of pictures. No memory: what it says belongs to this pair. Stateless,
// thread-safe.
class HandFinder {
 public:
  HandFinder(const TemplateSet& templates, HandFinderSettings settings);
  // One entry a side, left and right, visible or not.
  [[nodiscard]] std::array<SeenHand, 2> find(const StereoBlobs& input) const;

 private:
  struct Mark {
    Eigen::Vector3d p_Root_m;
    double quality;
    std::array<std::array<double, 4>, 2> box;
  };
  [[nodiscard]] std::vector<Mark> marks(int colour, const StereoBlobs& input) const;

  int knuckle_colour_;
  int wrist_colour_;
  HandFinderSettings settings_;
};

}  // namespace nido::vision
