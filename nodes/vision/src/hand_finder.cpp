#include "nido/vision/hand_finder.h"

#include <algorithm>
#include <cmath>

namespace nido::vision {

HandFinder::HandFinder(const TemplateSet& templates, HandFinderSettings settings)
    : knuckle_colour_(templates.colour_index(templates.knuckle_colour)),
      wrist_colour_(templates.colour_index(templates.wrist_colour)),
      settings_(settings) {}

// Discs of one colour that both eyes see at one place and in a size that fits.
std::vector<HandFinder::Mark> HandFinder::marks(int colour, const StereoBlobs& input) const {
  std::vector<Mark> result;
  for (const Blob& left : *input.blobs[0]) {
    if (left.colour != colour) continue;
    for (const Blob& right : *input.blobs[1]) {
      if (right.colour != colour) continue;
      const auto p = meet(input.eyes, left.centroid_px, right.centroid_px, settings_.tolerance_m);
      if (!p) continue;
      const double distance_m = (*p - input.eyes[0].X_RootCamera.translation()).norm();
      const double full_px2 =
          M_PI * std::pow(settings_.mark_radius_m * input.eyes[0].camera.fx_px / distance_m, 2);
      // a disc seen askew is smaller than one seen straight; a finger may hide a part
      const double share = std::min(left.area_px, right.area_px) / full_px2;
      if (distance_m < 0.1 || distance_m > 0.8 || share < 0.12 || share > 1.6) continue;
      const double alike =
          static_cast<double>(std::min(left.area_px, right.area_px)) / std::max(left.area_px, right.area_px);
      if (alike < 0.45) continue;
      result.push_back({*p, alike * std::min(1.0, share / 0.4), {left.box(), right.box()}});
    }
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Mark& a, const Mark& b) { return a.quality > b.quality; });
  // one blob belongs to one mark
  std::vector<Mark> unique;
  for (const Mark& mark : result) {
    const bool used = std::any_of(unique.begin(), unique.end(), [&](const Mark& u) {
      return u.box[0] == mark.box[0] || u.box[1] == mark.box[1];
    });
    if (!used) unique.push_back(mark);
  }
  return unique;
}

std::array<SeenHand, 2> HandFinder::find(const StereoBlobs& input) const {
  const std::vector<Mark> knuckles = marks(knuckle_colour_, input);
  std::vector<Mark> wrists = marks(wrist_colour_, input);
  const Eigen::Vector3d p_RootEyes =
      0.5 * (input.eyes[0].X_RootCamera.translation() + input.eyes[1].X_RootCamera.translation());
  std::vector<SeenHand> hands;
  for (const Mark& knuckle : knuckles) {
    SeenHand hand;
    hand.visible = true;
    hand.p_RootKnuckle_m = knuckle.p_Root_m;
    hand.confidence = 0.6 * knuckle.quality;
    hand.box = knuckle.box;
    std::size_t best = wrists.size();
    double best_error_m = settings_.tolerance_m;
    for (std::size_t w = 0; w < wrists.size(); ++w) {
      const double error_m =
          std::abs((wrists[w].p_Root_m - knuckle.p_Root_m).norm() - settings_.marks_apart_m);
      if (error_m < best_error_m) {
        best_error_m = error_m;
        best = w;
      }
    }
    if (best < wrists.size()) {
      const Mark wrist = wrists[best];
      wrists.erase(wrists.begin() + static_cast<std::ptrdiff_t>(best));
      const Eigen::Vector3d x = (knuckle.p_Root_m - wrist.p_Root_m).normalized();
      const Eigen::Vector3d to_eyes = p_RootEyes - knuckle.p_Root_m;
      const Eigen::Vector3d z = (to_eyes - to_eyes.dot(x) * x).normalized();
      Eigen::Matrix3d R;
      R << x, z.cross(x), z;
      hand.q_RootHand = Eigen::Quaterniond(R);
      hand.has_orientation = true;
      hand.confidence = std::min(
          1.0, 0.6 * knuckle.quality + 0.4 * wrist.quality * (1 - best_error_m / settings_.tolerance_m));
      for (std::size_t e = 0; e < 2; ++e) {
        const auto& b = wrist.box[e];
        auto& box = hand.box[e];
        const double right = std::max(box[0] + box[2], b[0] + b[2]);
        const double bottom = std::max(box[1] + box[3], b[1] + b[3]);
        box[0] = std::min(box[0], b[0]);
        box[1] = std::min(box[1], b[1]);
        box[2] = right - box[0];
        box[3] = bottom - box[1];
      }
    }
    hands.push_back(hand);
  }
  std::stable_sort(hands.begin(), hands.end(),
                   [](const SeenHand& a, const SeenHand& b) { return a.confidence > b.confidence; });
  if (hands.size() > 2) hands.resize(2);

  std::array<SeenHand, 2> sides;
  sides[0].side = "left";
  sides[1].side = "right";
  const auto put = [&](std::size_t side, const SeenHand& hand) {
    const std::string name = sides[side].side;
    sides[side] = hand;
    sides[side].side = name;
  };
  if (hands.size() == 2) {
    const bool first_is_right = hands[0].p_RootKnuckle_m.y() > hands[1].p_RootKnuckle_m.y();
    put(first_is_right ? 1 : 0, hands[0]);
    put(first_is_right ? 0 : 1, hands[1]);
  } else if (hands.size() == 1) {
    put(hands[0].p_RootKnuckle_m.y() > settings_.middle_y_m ? 1 : 0, hands[0]);
  }
  return sides;
}

}  // namespace nido::vision
