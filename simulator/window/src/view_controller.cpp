#include "nido/simulator/window/view_controller.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nido::sim {
namespace {

// As the outside camera of icub_sim looks: from the front right on robot and table.
const Eigen::Vector3d kTarget_World_m(-0.2, 0.05, 0.0);
constexpr double kDistance_m = 1.4;
constexpr double kYaw_rad = 2.55;
constexpr double kPitch_rad = 0.41;

constexpr double kFov_rad = 45 * std::numbers::pi / 180;
constexpr double kTurn_rad_px = 0.008;
constexpr double kHighest_rad = 1.5;  // straight above, the picture would have no up
constexpr double kZoomOfNotch = 0.88;
constexpr double kNearest_m = 0.1;
constexpr double kFarthest_m = 12;
constexpr double kTargetWithin_m = 10;

// Fast enough to follow a hand, slow enough for a force that changes twenty times a second.
constexpr double kSpringRate_1_s = 10;
constexpr double kDamping = 0.7;
constexpr double kMostWeights = 5;
constexpr double kMost_N = 900;  // the world port takes 1000
constexpr double kGravity_m_s2 = 9.81;

}  // namespace

ViewController::ViewController(int width, int height) : width_(width), height_(height) {
  look_from_the_start();
}

void ViewController::look_from_the_start() {
  p_WorldTarget_m_ = kTarget_World_m;
  distance_m_ = kDistance_m;
  yaw_rad_ = kYaw_rad;
  pitch_rad_ = kPitch_rad;
}

void ViewController::resize(int width, int height) {
  width_ = std::clamp(width, 1, 4096);
  height_ = std::clamp(height, 1, 4096);
}

Camera ViewController::camera() const {
  const Eigen::Vector3d way(std::cos(pitch_rad_) * std::cos(yaw_rad_),
                            std::cos(pitch_rad_) * std::sin(yaw_rad_), std::sin(pitch_rad_));
  return lookAt(p_WorldTarget_m_ + distance_m_ * way, p_WorldTarget_m_, width_, height_, kFov_rad);
}

Eigen::Vector3d ViewController::p_WorldMouse_m() const {
  const Camera view = camera();
  if (!grab_) return p_WorldTarget_m_;
  return view.X_WorldCamera * Eigen::Vector3d((grab_->x_px - view.cx_px) / view.fx_px * grab_->depth_m,
                                              (grab_->y_px - view.cy_px) / view.fy_px * grab_->depth_m,
                                              grab_->depth_m);
}

void ViewController::drag(double dx_px, double dy_px) {
  if (drag_ == Drag::kRound) {
    yaw_rad_ = std::remainder(yaw_rad_ - kTurn_rad_px * dx_px, 2 * std::numbers::pi);
    pitch_rad_ = std::clamp(pitch_rad_ + kTurn_rad_px * dy_px, -kHighest_rad, kHighest_rad);
  } else if (drag_ == Drag::kShift) {
    // what is under the mouse stays there, at the target's distance
    const Camera view = camera();
    const Eigen::Vector3d shift_Camera(-dx_px / view.fx_px * distance_m_, -dy_px / view.fy_px * distance_m_,
                                       0);
    p_WorldTarget_m_ = (p_WorldTarget_m_ + view.X_WorldCamera.linear() * shift_Camera)
                           .cwiseMax(-kTargetWithin_m)
                           .cwiseMin(kTargetWithin_m);
  }
}

void ViewController::key(char key) {
  switch (key) {
    case ' ':
      actions_.push_back(Action::kPauseOrGo);
      break;
    case '.':
      actions_.push_back(Action::kStep);
      break;
    case 'q':
      actions_.push_back(Action::kClose);
      break;
    case 'c':
      contacts_ = !contacts_;
      break;
    case 'j':
      joints_ = !joints_;
      break;
    case 'h':
      help_ = !help_;
      break;
    case 'v':
      look_from_the_start();
      break;
    default:
      break;
  }
}

void ViewController::handle(const InputEvent& event, const Picker& pick) {
  if (event.kind == InputEvent::Kind::kKey) return key(event.key);
  if (!std::isfinite(event.x_px) || !std::isfinite(event.y_px) || !std::isfinite(event.scroll)) return;
  const double dx_px = event.x_px - x_px_;
  const double dy_px = event.y_px - y_px_;
  x_px_ = event.x_px;
  y_px_ = event.y_px;
  switch (event.kind) {
    case InputEvent::Kind::kPress:
      if (grab_ || drag_ != Drag::kNone) return;  // another button is down
      if (event.button != InputEvent::Button::kLeft) {
        drag_ = Drag::kShift;
        return;
      }
      if (const std::optional<Pick> found = pick(event.x_px, event.y_px)) {
        grab_ = Grab{found->object, found->X_WorldObject.inverse() * found->p_World_m,
                     (camera().X_WorldCamera.inverse() * found->p_World_m).z(), event.x_px, event.y_px};
      } else {
        drag_ = Drag::kRound;
      }
      return;
    case InputEvent::Kind::kRelease:
      if (event.button == InputEvent::Button::kLeft) {
        grab_.reset();
        if (drag_ == Drag::kRound) drag_ = Drag::kNone;
      } else if (drag_ == Drag::kShift) {
        drag_ = Drag::kNone;
      }
      return;
    case InputEvent::Kind::kMove:
      if (grab_) {
        grab_->x_px = event.x_px;
        grab_->y_px = event.y_px;
      } else {
        drag(dx_px, dy_px);
      }
      return;
    case InputEvent::Kind::kScroll:
      distance_m_ = std::clamp(distance_m_ * std::pow(kZoomOfNotch, std::clamp(event.scroll, -20.0, 20.0)),
                               kNearest_m, kFarthest_m);
      return;
    case InputEvent::Kind::kKey:
      return;
  }
}

std::vector<ViewController::Action> ViewController::take_actions() {
  std::vector<Action> taken;
  taken.swap(actions_);
  return taken;
}

Eigen::Vector3d spring_force_N(double mass_kg, const Eigen::Vector3d& p_World_m,
                               const Eigen::Vector3d& v_World_m_s, const Eigen::Vector3d& p_WorldMouse_m) {
  const Eigen::Vector3d force_N =
      mass_kg * (kSpringRate_1_s * kSpringRate_1_s * (p_WorldMouse_m - p_World_m) -
                 2 * kDamping * kSpringRate_1_s * v_World_m_s);
  const double most_N = std::min(kMost_N, kMostWeights * mass_kg * kGravity_m_s2);
  const double size_N = force_N.norm();
  return size_N > most_N ? Eigen::Vector3d(force_N * (most_N / size_N)) : force_N;
}

}  // namespace nido::sim
