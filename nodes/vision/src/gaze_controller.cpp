#include "nido/vision/gaze_controller.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace nido::vision {
namespace {

constexpr int kNeckPitch = 0;
constexpr int kNeckRoll = 1;
constexpr int kNeckYaw = 2;
constexpr int kTilt = 3;
constexpr int kVersion = 4;
constexpr int kVergence = 5;

}  // namespace

Result<GazeController> GazeController::create(const RobotModel& model, const PinholeCamera& camera,
                                              GazeSettings settings) {
  const auto head = model.part_index("head");
  if (!head) return head.error();
  const auto torso = model.part_index("torso");
  if (!torso) return torso.error();
  if (model.parts()[*head].axes.size() != 6 || model.parts()[*torso].axes.size() != 3) {
    return Error{ErrorCode::kInvalidArgument, "gaze needs a head of 6 joints and a torso of 3"};
  }
  GazeController controller(model, camera, std::move(settings));
  controller.head_first_ = model.parts()[*head].first_axis;
  controller.torso_first_ = model.parts()[*torso].first_axis;
  for (std::size_t i = 0; i < 6; ++i) {
    const Axis& axis = model.parts()[*head].axes[i];
    controller.lower_[i] = axis.lower_rad + controller.settings_.margin_rad;
    controller.upper_[i] = axis.upper_rad - controller.settings_.margin_rad;
  }
  std::size_t e = 0;
  for (const char* side : {"left", "right"}) {
    const auto link = model.camera_link(side);
    if (!link) return link.error();
    controller.camera_links_[e++] = *link;
  }
  if (controller.settings_.scan_Root_m.empty()) {
    return Error{ErrorCode::kInvalidArgument, "gaze needs at least one place to scan"};
  }
  return controller;
}

GazeController::GazeController(const RobotModel& model, const PinholeCamera& camera, GazeSettings settings)
    : model_(&model),
      camera_(camera),
      settings_(std::move(settings)),
      p_RootLook_m_(settings_.p_RootRest_m) {}

Status GazeController::set_goal(const GazeGoal& goal) {
  const bool known = goal.mode == "rest" || goal.mode == "search" || goal.mode == "object" ||
                     goal.mode == "hand" || goal.mode == "point";
  if (!known) {
    return Error{ErrorCode::kInvalidArgument,
                 "gaze mode \"" + goal.mode + "\" is unknown; allowed are rest, search, object, hand, point"};
  }
  if (goal.mode == "object" && goal.target.empty()) {
    return Error{ErrorCode::kInvalidArgument, "gaze mode \"object\" needs the name of an object as target"};
  }
  if (goal.mode == "hand" && goal.target != "left" && goal.target != "right") {
    return Error{ErrorCode::kInvalidArgument,
                 "gaze mode \"hand\" needs the target left or right, not \"" + goal.target + "\""};
  }
  if (goal.mode == "point" && !goal.p_Root_m.allFinite()) {
    return Error{ErrorCode::kInvalidArgument, "gaze mode \"point\" needs three finite numbers"};
  }
  const bool same = goal.mode == goal_.mode && goal.target == goal_.target;
  goal_ = goal;
  if (!same) {
    scan_place_ = 0;
    still_since_.reset();
    search_done_ = false;
    lost_ = false;
  }
  return {};
}

Eigen::Vector4d GazeController::pixel_error(const Eigen::Vector3d& p_Root_m,
                                            const std::array<double, 3>& torso_rad,
                                            const HeadJoints& head) const {
  Eigen::VectorXd axes = model_->zero_axes();
  for (int i = 0; i < 6; ++i) axes[head_first_ + i] = head[static_cast<std::size_t>(i)];
  for (int i = 0; i < 3; ++i) axes[torso_first_ + i] = torso_rad[static_cast<std::size_t>(i)];
  Eigen::Vector4d error;
  for (std::size_t e = 0; e < 2; ++e) {
    const Eigen::Vector3d p = model_->X_RootLink(camera_links_[e], axes).inverse() * p_Root_m;
    // angles rather than image coordinates, so that points behind the eyes have a way back
    const double forward = std::max(p.z(), 1e-3);
    const auto k = static_cast<Eigen::Index>(2 * e);
    error[k] = camera_.fx_px * std::atan2(p.x(), p.z() > 0 ? p.z() : forward);
    error[k + 1] = camera_.fy_px * std::atan2(p.y(), p.z() > 0 ? p.z() : forward);
  }
  return error;
}

void GazeController::centre(const Eigen::Vector3d& p_Root_m, const std::array<double, 3>& torso_rad,
                            const std::vector<int>& joints, HeadJoints& head) const {
  const auto n = static_cast<Eigen::Index>(joints.size());
  for (int iteration = 0; iteration < 6; ++iteration) {
    const Eigen::Vector4d error = pixel_error(p_Root_m, torso_rad, head);
    Eigen::MatrixXd J(4, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      HeadJoints moved = head;
      constexpr double kStep = 1e-5;
      moved[static_cast<std::size_t>(joints[k])] += kStep;
      J.col(k) = (pixel_error(p_Root_m, torso_rad, moved) - error) / kStep;
    }
    const Eigen::MatrixXd normal = J.transpose() * J + Eigen::MatrixXd::Identity(n, n) * 1.0;
    Eigen::VectorXd move = -normal.ldlt().solve(J.transpose() * error);
    const double largest = move.cwiseAbs().maxCoeff();
    if (largest > 0.4) move *= 0.4 / largest;
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto j = static_cast<std::size_t>(joints[k]);
      head[j] = std::clamp(head[j] + move[k], lower_[j], upper_[j]);
    }
    if (largest < 1e-4) break;
  }
}

GazeController::HeadJoints GazeController::solve(const Eigen::Vector3d& p_Root_m,
                                                 const std::array<double, 3>& torso_rad,
                                                 const HeadJoints& start_rad) const {
  HeadJoints head = start_rad;
  head[kNeckRoll] = 0;
  head[kTilt] = settings_.eyes_tilt_wanted_rad;
  head[kVersion] = 0;
  centre(p_Root_m, torso_rad, {kNeckPitch, kNeckYaw, kVergence}, head);
  centre(p_Root_m, torso_rad, {kTilt, kVersion, kVergence}, head);
  return head;
}

Eigen::Vector3d GazeController::choose_point(Time now, bool still, const std::optional<GazeTarget>& target) {
  if (goal_.mode == "rest") return settings_.p_RootRest_m;
  if (goal_.mode == "point") return goal_.p_Root_m;
  if (target && target->age_s < settings_.lost_s) {
    lost_ = false;
    search_done_ = false;
    still_since_.reset();
    return target->p_Root_m;
  }
  if (goal_.mode == "hand") return target ? target->p_Root_m : settings_.p_RootRest_m;
  // scan: look at every place for a moment
  if (!lost_) {
    lost_ = true;
    scan_place_ = 0;
    still_since_.reset();
  }
  const Eigen::Vector3d place = settings_.scan_Root_m[scan_place_];
  const bool arrived = still && (place - p_RootLook_m_).norm() < 1e-6;
  if (!arrived) {
    still_since_.reset();
  } else if (!still_since_) {
    still_since_ = now;
  } else if (Time{now.ns - still_since_->ns}.seconds() > settings_.dwell_s) {
    still_since_.reset();
    if (++scan_place_ == settings_.scan_Root_m.size()) {
      scan_place_ = 0;
      search_done_ = true;
    }
  }
  return settings_.scan_Root_m[scan_place_];
}

GazeController::Output GazeController::step(Time now, double period_s, const HeadJoints& head_rad,
                                            const std::array<double, 3>& torso_rad, double head_speed_rad_s,
                                            const std::optional<GazeTarget>& target) {
  if (!started_) {
    started_ = true;
    command_ = head_rad;
  }
  const bool still = head_speed_rad_s < settings_.still_rad_s;
  // where the point would be seen, by the encoders: also tells whether a scanned place has been reached
  const auto off_px = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector4d error = pixel_error(p, torso_rad, head_rad);
    return std::max(error.head<2>().norm(), error.tail<2>().norm());
  };
  const bool place_reached = off_px(p_RootLook_m_) < 4 * settings_.fixated_px;
  p_RootLook_m_ = choose_point(now, still && place_reached, target);

  const HeadJoints wanted = solve(p_RootLook_m_, torso_rad, command_);
  // neck: critically damped towards the wanted place, within its speed
  const std::array<int, 3> neck = {kNeckPitch, kNeckRoll, kNeckYaw};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto j = static_cast<std::size_t>(neck[k]);
    const double w = 2.0 / settings_.neck_time_s;
    const double acceleration = w * w * (wanted[j] - command_[j]) - 2 * w * neck_speed_[k];
    neck_speed_[k] = std::clamp(neck_speed_[k] + acceleration * period_s, -settings_.neck_speed_rad_s,
                                settings_.neck_speed_rad_s);
    command_[j] = std::clamp(command_[j] + neck_speed_[k] * period_s, lower_[j], upper_[j]);
  }
  // eyes: what makes the point central with the neck as it stands now
  HeadJoints eyes = head_rad;
  centre(p_RootLook_m_, torso_rad, {kTilt, kVersion, kVergence}, eyes);
  for (const int joint : {kTilt, kVersion, kVergence}) {
    const auto j = static_cast<std::size_t>(joint);
    const double step = settings_.eye_speed_rad_s * period_s * (joint == kVergence ? 2.0 : 1.0);
    command_[j] =
        std::clamp(command_[j] + std::clamp(eyes[j] - command_[j], -step, step), lower_[j], upper_[j]);
  }

  Output out;
  out.command_rad = command_;
  out.status.mode = goal_.mode;
  out.status.target = goal_.target;
  out.status.search_done = search_done_;
  const bool needs_sight = goal_.mode != "rest" && goal_.mode != "point";
  const bool in_sight = target && target->age_s < 0.2;
  const Eigen::Vector3d looked_for = needs_sight && in_sight ? target->p_Root_m : p_RootLook_m_;
  // what lies too near to be centred within the joints' limits is fixated as well as it can be
  const Eigen::Vector4d best = pixel_error(looked_for, torso_rad, wanted);
  const double best_px = std::max(best.head<2>().norm(), best.tail<2>().norm());
  const double allowed_px = std::max(settings_.fixated_px, best_px + settings_.fixated_px / 2);
  out.status.fixated = still && (!needs_sight || in_sight) && off_px(looked_for) < allowed_px;
  return out;
}

}  // namespace nido::vision
