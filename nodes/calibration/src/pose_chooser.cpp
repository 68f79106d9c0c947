#include "nido/calibration/pose_chooser.h"

#include <Eigen/Dense>
#include <algorithm>

namespace nido::calibration {
namespace {

constexpr double kMargin_px = 40.0;  // of the marks to the picture's edge: the body may not be as believed
constexpr double kLimitMargin_rad = 0.04;
constexpr int kTries = 200;

}  // namespace

PoseChooser::PoseChooser(const RobotModel& model, const reach::ArmChain& chain, const std::string& side,
                         const PinholeCamera& camera, std::uint64_t seed)
    : model_(model), drawer_(chain, side, true), camera_(camera), random_(seed) {}

Result<PoseChooser> PoseChooser::create(const RobotModel& model, const std::string& side,
                                        const PinholeCamera& camera, std::uint64_t seed) {
  const auto chain = reach::ArmChain::from_model(model, side);
  if (!chain) return chain.error();
  PoseChooser chooser(model, *chain, side, camera, seed);
  const auto hand = model.hand(side);
  if (!hand) return hand.error();
  int found = 0;
  for (const HandMark& mark : hand->marks) {
    if (mark.name == "knuckle") chooser.marks_[0] = mark.link, ++found;
    if (mark.name == "wrist") chooser.marks_[1] = mark.link, ++found;
  }
  if (found != 2)
    return Error{ErrorCode::kInvalidArgument, "the " + side + " hand has no marks 'knuckle' and 'wrist'"};
  for (std::size_t e = 0; e < 2; ++e) {
    const auto link = model.camera_link(e == 0 ? "left" : "right");
    if (!link) return link.error();
    chooser.eyes_[e] = *link;
  }
  for (const auto& [part, first] :
       std::initializer_list<std::pair<std::string, int*>>{{"head", &chooser.head_first_},
                                                           {"torso", &chooser.torso_first_},
                                                           {side + "_arm", &chooser.arm_first_}}) {
    const auto index = model.part_index(part);
    if (!index) return index.error();
    *first = model.parts()[static_cast<std::size_t>(*index)].first_axis;
  }
  for (int i = 0; i < 6; ++i) {
    chooser.lower_(i) = model.axis(chooser.head_first_ + i).lower_rad + kLimitMargin_rad;
    chooser.upper_(i) = model.axis(chooser.head_first_ + i).upper_rad - kLimitMargin_rad;
  }
  return chooser;
}

Eigen::VectorXd PoseChooser::axes(const reach::Joints& arm_rad, const HeadAngles& head_rad) const {
  Eigen::VectorXd axes = model_.zero_axes();
  axes.segment<reach::kTorsoJoints>(torso_first_) = arm_rad.head<reach::kTorsoJoints>();
  axes.segment<reach::kArmJoints>(arm_first_) = arm_rad.tail<reach::kArmJoints>();
  axes.segment<6>(head_first_) = head_rad;
  return axes;
}

std::array<std::array<std::optional<Eigen::Vector2d>, 2>, 2> PoseChooser::expected_px(
    const Eigen::VectorXd& axes_rad) const {
  std::array<std::array<std::optional<Eigen::Vector2d>, 2>, 2> px;
  for (std::size_t e = 0; e < 2; ++e) {
    const Eigen::Isometry3d X_CameraRoot = model_.X_RootLink(eyes_[e], axes_rad).inverse();
    for (std::size_t m = 0; m < 2; ++m)
      px[e][m] = camera_.project(X_CameraRoot * model_.X_RootLink(marks_[m], axes_rad).translation());
  }
  return px;
}

std::optional<HeadAngles> PoseChooser::look_at_hand(const reach::Joints& arm_rad) {
  const auto within = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  };
  HeadAngles head;
  head << within(-0.6, 0.2), within(-0.35, 0.35), within(-0.7, 0.7), -0.15, 0.0, 0.25;
  const Eigen::Vector3d wanted_px(camera_.cx_px + within(-70, 70), camera_.cy_px + within(-45, 45),
                                  camera_.cx_px + within(-70, 70));
  // tilt, version and vergence bring the knuckles to the wanted places
  const auto seen = [&](const HeadAngles& at) -> std::optional<Eigen::Vector3d> {
    const auto px = expected_px(axes(arm_rad, at));
    if (!px[0][0] || !px[1][0]) return std::nullopt;
    return Eigen::Vector3d(px[0][0]->x(), px[0][0]->y(), px[1][0]->x());
  };
  for (int iteration = 0; iteration < 8; ++iteration) {
    const auto now = seen(head);
    if (!now) return std::nullopt;
    if ((*now - wanted_px).norm() < 2.0) break;
    Eigen::Matrix3d J;
    for (int j = 0; j < 3; ++j) {
      HeadAngles there = head;
      there(3 + j) += 1e-3;
      const auto moved = seen(there);
      if (!moved) return std::nullopt;
      J.col(j) = (*moved - *now) / 1e-3;
    }
    head.tail<3>() += J.fullPivLu().solve(wanted_px - *now).cwiseMax(-0.3).cwiseMin(0.3);
    head = head.cwiseMax(lower_).cwiseMin(upper_);
  }
  const auto px = expected_px(axes(arm_rad, head));
  for (const auto& eye : px) {
    for (const auto& mark : eye) {
      if (!mark || !camera_.contains(*mark, kMargin_px)) return std::nullopt;
    }
  }
  return head;
}

std::optional<Pose> PoseChooser::next(const reach::Joints& now) {
  std::optional<Pose> best;
  double best_rad = 0;
  for (int tries = 0, found = 0; tries < kTries && found < 3; ++tries) {
    const auto drawn = drawer_.draw(random_);
    if (!drawn) return std::nullopt;
    Pose pose;
    pose.arm_rad = *drawn;
    pose.arm_rad.head<reach::kTorsoJoints>().setZero();
    // straight in joint space, clear of the body all the way
    bool clear = true;
    for (int i = 1; i <= 12 && clear; ++i)
      clear = drawer_.is_clear_of_body(now + (pose.arm_rad - now) * (i / 12.0));
    if (!clear && tries < kTries / 2) continue;
    const auto head = look_at_hand(pose.arm_rad);
    if (!head) continue;
    pose.head_rad = *head;
    ++found;
    const double way_rad = (pose.arm_rad - now).cwiseAbs().maxCoeff();
    if (!best || way_rad < best_rad) {
      best = pose;
      best_rad = way_rad;
    }
  }
  return best;
}

}  // namespace nido::calibration
