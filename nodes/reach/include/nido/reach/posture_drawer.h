#pragma once

#include <optional>
#include <random>
#include <string>

#include "nido/reach/arm_chain.h"

namespace nido::reach {

// Draws postures evenly over the joints' ranges and keeps those in which the hand is in front of the body,
// clear of it, with its back not turned away from the eyes (the body's own geometry says so).
// Thread-compatible.
class PostureDrawer {
 public:
  // side: of the hand, "right" or "left". whole_body: torso and wrist move too; else the first five joints of
  // the arm alone.
  PostureDrawer(const ArmChain& chain, const std::string& side, bool whole_body);

  // Nothing when 200 000 draws gave no such posture.
  [[nodiscard]] std::optional<Joints> draw(std::mt19937_64& random) const;
  [[nodiscard]] bool is_clear_of_body(const Joints& q) const;
  // The joints that are moved, and how far.
  [[nodiscard]] const Joints& low() const { return low_; }
  [[nodiscard]] const Joints& high() const { return high_; }

 private:
  [[nodiscard]] bool is_useful(const Joints& q) const;

  ArmChain chain_;
  bool is_right_;
  Joints low_ = Joints::Zero();
  Joints high_ = Joints::Zero();
  // Where the eyes can look (root frame): in front of the body, more to the hand's side.
  Eigen::Vector3d space_min_Root_m_ = {-0.48, -0.20, -0.12};
  Eigen::Vector3d space_max_Root_m_ = {-0.12, 0.45, 0.32};
};

}  // namespace nido::reach
