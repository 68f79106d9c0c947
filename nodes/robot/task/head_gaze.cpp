#include "task/head_gaze.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace nido {
namespace {

constexpr Eigen::Index kHeadJoints = 6;
constexpr double kPeakOfMinimumJerk = 1.875;
constexpr double kReached_px = 3;
constexpr double kStill_rad = 0.01;
constexpr double kShortest_s = 0.15;
constexpr double kFarthest_m = 100;
// neck slowly, eyes quickly
constexpr std::array<double, 6> kSpeed_rad_s = {0.8, 0.8, 0.8, 1.5, 1.5, 1.5};
constexpr std::array<int, 6> kHead = {0, 1, 2, 3, 4, 5};

constexpr double kSmallestVergence_rad = 3.14159265358979323846 / 180;
constexpr double kParallel = 1e-6;

// The middle between the eyes, with the turn of the left one; of eyes that look straight ahead both have the
// same.
Eigen::Isometry3d middle_of(const std::array<Eigen::Isometry3d, 2>& X_RootEyes) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = (X_RootEyes[0].translation() + X_RootEyes[1].translation()) / 2;
  const Eigen::Quaterniond left(X_RootEyes[0].linear());
  X.linear() = left.slerp(0.5, Eigen::Quaterniond(X_RootEyes[1].linear())).toRotationMatrix();
  return X;
}
double half_baseline_m(const std::array<Eigen::Isometry3d, 2>& X_RootEyes) {
  return (X_RootEyes[0].translation() - X_RootEyes[1].translation()).norm() / 2;
}

double minimum_jerk(double s) { return s * s * s * (10 + s * (-15 + 6 * s)); }

}  // namespace

Result<std::unique_ptr<HeadGaze>> HeadGaze::create(RobotModel model, const PinholeCamera& camera,
                                                   IControlBoard& head, IControlBoard& torso,
                                                   const IClock& clock) {
  auto kept = std::make_unique<RobotModel>(std::move(model));
  const Result<GazeSolver> solver = GazeSolver::create(*kept, camera);
  if (!solver) return solver.error();
  if (head.axes() < kHeadJoints || torso.axes() < 3) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a head has 6 joints and a torso 3: these boards have {} and {}", head.axes(),
                             torso.axes())};
  }
  return std::unique_ptr<HeadGaze>(new HeadGaze(std::move(kept), camera, *solver, head, torso, clock));
}

Result<HeadGaze::Posture> HeadGaze::read() const {
  const Result<JointReading> torso = torso_.read_joints();
  if (!torso) return torso.error();
  const Result<JointReading> head = head_.read_joints();
  if (!head) return head.error();
  Posture posture;
  for (Eigen::Index j = 0; j < kHeadJoints; ++j) {
    posture.head_rad[j] = head->position_rad[static_cast<std::size_t>(j)];
  }
  for (Eigen::Index j = 0; j < 3; ++j) {
    posture.torso_rad[j] = torso->position_rad[static_cast<std::size_t>(j)];
  }
  posture.stamp_ns = head->stamp_ns;
  return posture;
}

Result<GazeState> HeadGaze::state() const {
  const Result<Posture> now = read();
  if (!now) return now.error();
  const std::lock_guard lock(mutex_);
  GazeState state;
  state.stamp_ns = now->stamp_ns;
  state.p_RootFixation_m = solver_.p_RootFixation_m(now->torso_rad, now->head_rad);
  state.torso_rad = now->torso_rad;
  state.head_rad = now->head_rad;
  state.X_RootEyes = X_RootEyes(now->torso_rad, now->head_rad);
  const auto rest = X_RootEyes(TorsoAngles::Zero(), HeadAngles::Zero());
  const Eigen::Vector3d p_m = middle_of(rest).inverse() * state.p_RootFixation_m;
  state.angles_rad = {std::atan2(p_m.x(), p_m.z()), -std::atan2(p_m.y(), std::abs(p_m.z())),
                      2 * std::atan2(half_baseline_m(rest), p_m.norm())};
  if (motion_) {
    state.moving = motion_->moving;
    state.error_px = solver_.error_px(motion_->p_Root_m, now->torso_rad, now->head_rad);
  }
  return state;
}

Status HeadGaze::look_at(const Eigen::Vector3d& p_Root_m) {
  if (!p_Root_m.allFinite() || p_Root_m.norm() > kFarthest_m) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a point to look at is three finite numbers, at most {} m away", kFarthest_m)};
  }
  const Result<Posture> now = read();
  if (!now) return now.error();
  const std::lock_guard lock(mutex_);
  const HeadAngles from_rad = motion_ ? motion_->sent_rad : now->head_rad;
  const GazeSolution found = solver_.solve(p_Root_m, now->torso_rad, from_rad);
  if (found.error_px > kReached_px) {
    return Error{ErrorCode::kFailed,
                 fmt::format("neck and eyes cannot turn so far: the point stays {:.0f} pixels off the middle",
                             found.error_px)};
  }
  // joints that take no command now refuse the whole motion; where they are moves none
  if (Status able = head_.set_positions(kHead, {from_rad.data(), kHeadJoints}); !able) return able;
  double duration_s = kShortest_s;
  for (Eigen::Index j = 0; j < kHeadJoints; ++j) {
    duration_s = std::max(duration_s, kPeakOfMinimumJerk * std::abs(found.head_rad[j] - from_rad[j]) /
                                          kSpeed_rad_s[static_cast<std::size_t>(j)]);
  }
  motion_ = Motion{p_Root_m, from_rad, found.head_rad, from_rad, clock_.now_ns(), duration_s};
  return {};
}

Status HeadGaze::look_at_pixel(int eye, const Eigen::Vector2d& px, double distance_m) {
  if (eye != 0 && eye != 1) {
    return Error{ErrorCode::kInvalidArgument, "there are eye 0, the left one, and eye 1, the right one"};
  }
  if (!px.allFinite() || !camera_.contains(px) || !(distance_m > 0.05 && distance_m <= kFarthest_m)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a pixel lies in the picture of {} x {}, and is 0.05 to {} m away",
                             camera_.width_px, camera_.height_px, kFarthest_m)};
  }
  const Result<Posture> now = read();
  if (!now) return now.error();
  return look_at(solver_.p_RootPixel_m(eye, px, distance_m, now->torso_rad, now->head_rad));
}

std::array<Eigen::Isometry3d, 2> HeadGaze::X_RootEyes(const TorsoAngles& torso_rad,
                                                      const HeadAngles& head_rad) const {
  Eigen::VectorXd axes_rad = model_->zero_axes();
  // the solver, which was made of this model, has found these
  axes_rad.segment<3>(model_->parts()[static_cast<std::size_t>(*model_->part_index("torso"))].first_axis) =
      torso_rad;
  axes_rad.segment<kHeadJoints>(
      model_->parts()[static_cast<std::size_t>(*model_->part_index("head"))].first_axis) = head_rad;
  return {model_->X_RootLink(*model_->camera_link("left"), axes_rad),
          model_->X_RootLink(*model_->camera_link("right"), axes_rad)};
}

Status HeadGaze::look_at_pixels(const Eigen::Vector2d& left_px, const Eigen::Vector2d& right_px) {
  if (!left_px.allFinite() || !right_px.allFinite() || !camera_.contains(left_px) ||
      !camera_.contains(right_px)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("pixels lie in the pictures of {} x {}", camera_.width_px, camera_.height_px)};
  }
  const Result<Posture> now = read();
  if (!now) return now.error();
  std::array<Eigen::Vector3d, 2> from_m;
  std::array<Eigen::Vector3d, 2> along;
  for (int eye = 0; eye < 2; ++eye) {
    const auto e = static_cast<std::size_t>(eye);
    const Eigen::Vector2d& px = eye == 0 ? left_px : right_px;
    from_m[e] = X_RootEyes(now->torso_rad, now->head_rad)[e].translation();
    along[e] = (solver_.p_RootPixel_m(eye, px, 1.0, now->torso_rad, now->head_rad) - from_m[e]).normalized();
  }
  // the points of both lines that are nearest to each other
  const double cosine = along[0].dot(along[1]);
  const Eigen::Vector3d between_m = from_m[1] - from_m[0];
  const double sine2 = 1 - cosine * cosine;
  const double left_m = (between_m.dot(along[0]) - cosine * between_m.dot(along[1])) / sine2;
  const double right_m = (cosine * between_m.dot(along[0]) - between_m.dot(along[1])) / sine2;
  if (sine2 < kParallel || left_m <= 0 || right_m <= 0) {
    return Error{
        ErrorCode::kInvalidArgument,
        "the lines of sight of these pixels do not meet before the eyes: is one point seen in both?"};
  }
  return look_at((from_m[0] + left_m * along[0] + from_m[1] + right_m * along[1]) / 2);
}

Status HeadGaze::look_by_angles(bool relative, const Eigen::Vector3d& angles_rad) {
  if (!angles_rad.allFinite() || angles_rad.cwiseAbs().maxCoeff() > 3.2) {
    return Error{ErrorCode::kInvalidArgument, "azimuth, elevation and vergence are at most 180 degrees"};
  }
  const Result<Posture> now = read();
  if (!now) return now.error();
  const TorsoAngles torso_rad = relative ? now->torso_rad : TorsoAngles::Zero();
  const HeadAngles head_rad = relative ? now->head_rad : HeadAngles::Zero();
  const auto eyes = X_RootEyes(torso_rad, head_rad);
  const double vergence_rad =
      std::max(kSmallestVergence_rad, angles_rad.z() + (relative ? now->head_rad[kHeadJoints - 1] : 0.0));
  const double distance_m = half_baseline_m(eyes) / std::tan(std::min(vergence_rad, 3.0) / 2);
  const double azimuth_rad = angles_rad.x();
  const double elevation_rad = angles_rad.y();
  // so that its azimuth and elevation are told as they were asked for
  const Eigen::Vector3d direction =
      Eigen::Vector3d(std::tan(azimuth_rad), -std::tan(elevation_rad), 1).normalized();
  if (std::abs(azimuth_rad) > 1.5 || std::abs(elevation_rad) > 1.5) {
    return Error{ErrorCode::kFailed,
                 "neck and eyes cannot turn so far: to the side and up at most 85 degrees"};
  }
  return look_at(middle_of(eyes) * (distance_m * direction));
}

Status HeadGaze::stop() {
  const std::lock_guard lock(mutex_);
  motion_.reset();
  return head_.stop(kHead);
}

Status HeadGaze::step_to(std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  if (!motion_) return {};
  const Result<Posture> now = read();
  if (!now) return now.error();
  Motion& motion = *motion_;
  // where the point is seen from the torso as it stands now
  motion.end_rad = solver_.solve(motion.p_Root_m, now->torso_rad, motion.end_rad).head_rad;
  const double share =
      std::clamp(static_cast<double>(now_ns - motion.begin_ns) * 1e-9 / motion.duration_s, 0.0, 1.0);
  motion.sent_rad = motion.start_rad + minimum_jerk(share) * (motion.end_rad - motion.start_rad);
  motion.moving = share < 1 || (now->head_rad - motion.sent_rad).cwiseAbs().maxCoeff() > kStill_rad;
  // a joint that takes no command ends the motion, not the robot
  if (!head_.set_positions(kHead, {motion.sent_rad.data(), kHeadJoints})) motion_.reset();
  return {};
}

}  // namespace nido
