#include "nido/reach/posture_drawer.h"

#include <algorithm>
#include <cmath>

namespace nido::reach {
namespace {

const Eigen::Vector3d kEyes_Root_m(-0.06, 0.0, 0.34);

}  // namespace

PostureDrawer::PostureDrawer(const ArmChain& chain, const std::string& side, bool whole_body)
    : chain_(chain), is_right_(side == "right") {
  if (!is_right_) {
    std::swap(space_min_Root_m_.y(), space_max_Root_m_.y());
    space_min_Root_m_.y() *= -1.0;
    space_max_Root_m_.y() *= -1.0;
  }
  low_ = chain_.min();
  high_ = chain_.max();
  // the trunk sways a little
  const double to_the_left_rad = is_right_ ? 0.35 : 0.5;
  low_(0) = std::max(low_(0), -to_the_left_rad);
  high_(0) = std::min(high_(0), 0.85 - to_the_left_rad);
  low_(1) = -0.15;
  high_(1) = 0.15;
  low_(2) = std::max(low_(2), -0.1);
  high_(2) = std::min(high_(2), 0.35);
  for (int joint = 0; joint < kJoints; ++joint) {
    const bool moves = (joint >= kTorsoJoints && joint < kTorsoJoints + 5) || whole_body;
    if (!moves) low_(joint) = high_(joint) = std::clamp(0.0, low_(joint), high_(joint));
  }
}

bool PostureDrawer::is_clear_of_body(const Joints& q) const {
  return std::ranges::all_of(chain_.body_points(q), [](const ArmChain::BodyPoint& point) {
    const Eigen::Vector3d& p = point.p_Root_m;
    const bool in_trunk = p.x() > -0.11 && p.x() < 0.12 && std::abs(p.y()) < 0.13 && p.z() < 0.24;
    const bool in_head = (p - Eigen::Vector3d(-0.03, 0.0, 0.32)).norm() < 0.13;
    return !in_trunk && !in_head;
  });
}

bool PostureDrawer::is_useful(const Joints& q) const {
  const Eigen::Isometry3d X = chain_.X_RootPalm(q);
  const Eigen::Vector3d p = X.translation();
  const bool in_space =
      (p - space_min_Root_m_).minCoeff() >= 0.0 && (space_max_Root_m_ - p).minCoeff() >= 0.0;
  const Eigen::Vector3d back_of_hand = -chain_.palm_z() * X.linear().col(2);
  return in_space && back_of_hand.dot((kEyes_Root_m - p).normalized()) > 0.35 && is_clear_of_body(q);
}

std::optional<Joints> PostureDrawer::draw(std::mt19937_64& random) const {
  std::uniform_real_distribution<double> share(0.0, 1.0);
  Joints q;
  for (int tries = 0; tries < 200000; ++tries) {
    for (int joint = 0; joint < kJoints; ++joint) {
      // drawn for joints at rest too, so that what one seed gives does not hang on which of them move
      q(joint) = low_(joint) + share(random) * (high_(joint) - low_(joint));
    }
    if (is_useful(q)) return q;
  }
  return std::nullopt;
}

}  // namespace nido::reach
