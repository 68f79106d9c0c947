#include "task/head_gaze.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "nido/kinematics/gaze_geometry.h"

namespace nido {
namespace {

constexpr Eigen::Index kHeadJoints = 6;
constexpr double kPeakOfMinimumJerk = 1.875;
constexpr double kReached_px = 3;
constexpr double kStill_rad = 0.01;
constexpr double kShortest_s = 0.15;
constexpr double kFarthest_m = 100;
constexpr double kDegrees = 180 / std::numbers::pi;
// neck slowly, eyes quickly
constexpr std::array<double, 6> kSpeed_rad_s = {0.8, 0.8, 0.8, 1.5, 1.5, 1.5};
constexpr std::array<int, 6> kHead = {0, 1, 2, 3, 4, 5};

constexpr double kLongest_s = 60;
constexpr double kRounded_rad = 1e-6;  // limits that came as degrees
constexpr Eigen::Index kNeckJoints = 3;
constexpr Eigen::Index kVersion = 4;
constexpr Eigen::Index kVergence = 5;

// how long joints need for a way
double time_of_s(const HeadAngles& way_rad, Eigen::Index first, Eigen::Index count) {
  double time_s = kShortest_s;
  for (Eigen::Index j = first; j < first + count; ++j) {
    time_s = std::max(time_s,
                      kPeakOfMinimumJerk * std::abs(way_rad[j]) / kSpeed_rad_s[static_cast<std::size_t>(j)]);
  }
  return time_s;
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
  const Result<int> head_link = kept->link_index("head_center");
  if (!head_link) return head_link.error();
  auto gaze =
      std::unique_ptr<HeadGaze>(new HeadGaze(std::move(kept), *head_link, *solver, head, torso, clock));
  GazeState ahead;
  gaze->place(ahead);
  const Eigen::Vector3d between_m = ahead.X_RootEyes[1].translation() - ahead.X_RootEyes[0].translation();
  gaze->body_ = {camera.width_px, camera.height_px, camera.fx_px, ahead.X_RootEyes[0], between_m.norm()};
  gaze->body_.X_RootAhead.translation() += between_m / 2;
  const HeadRange& own = solver->range();
  gaze->settings_.neck_lower_rad = gaze->body_.neck_lower_rad = own.lower_rad.head<kNeckJoints>();
  gaze->settings_.neck_upper_rad = gaze->body_.neck_upper_rad = own.upper_rad.head<kNeckJoints>();
  gaze->body_.vergence_upper_rad = own.upper_rad[kVergence];
  return gaze;
}

Result<GazeState> HeadGaze::read() const {
  const Result<JointReading> torso = torso_.read_joints();
  if (!torso) return torso.error();
  const Result<JointReading> head = head_.read_joints();
  if (!head) return head.error();
  GazeState state;
  state.stamp_ns = head->stamp_ns;
  for (Eigen::Index j = 0; j < kHeadJoints; ++j) {
    state.head_rad[j] = head->position_rad[static_cast<std::size_t>(j)];
    state.velocities_rad_s[j] = head->velocity_rad_s[static_cast<std::size_t>(j)];
  }
  for (Eigen::Index j = 0; j < 3; ++j) {
    state.torso_rad[j] = torso->position_rad[static_cast<std::size_t>(j)];
  }
  state.wanted_rad = state.head_rad;
  place(state);
  return state;
}

void HeadGaze::place(GazeState& state) const {
  Eigen::VectorXd axes_rad = model_->zero_axes();
  // the solver, which was made of this model, has found these
  axes_rad.segment<3>(model_->parts()[static_cast<std::size_t>(*model_->part_index("torso"))].first_axis) =
      state.torso_rad;
  axes_rad.segment<kHeadJoints>(
      model_->parts()[static_cast<std::size_t>(*model_->part_index("head"))].first_axis) = state.head_rad;
  state.X_RootEyes = {model_->X_RootLink(*model_->camera_link("left"), axes_rad),
                      model_->X_RootLink(*model_->camera_link("right"), axes_rad)};
  state.X_RootHead = model_->X_RootLink(head_link_, axes_rad);
}

Result<GazeState> HeadGaze::state() const {
  Result<GazeState> now = read();
  if (!now) return now.error();
  const std::lock_guard lock(mutex_);
  now->p_RootFixation_m = solver_.p_RootFixation_m(now->torso_rad, now->head_rad);
  now->angles_rad = angles_of(body_, now->p_RootFixation_m);
  now->progress = motion_ ? motion_->progress : progress_;
  if (motion_) {
    now->moving = motion_->moving;
    now->wanted_rad = motion_->end_rad;
    now->error_px = solver_.error_px(motion_->p_Root_m, now->torso_rad, now->head_rad);
  }
  return now;
}

Result<GazeSettings> HeadGaze::settings() const {
  const std::lock_guard lock(mutex_);
  return settings_;
}

Status HeadGaze::set_settings(const GazeSettings& settings) {
  GazeSettings wanted = settings;
  const HeadRange& own = solver_.range();
  for (const double time_s : {wanted.neck_s, wanted.eyes_s}) {
    if (!(time_s > 0 && time_s <= kLongest_s)) {
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("a motion of the head takes more than 0 and at most {} s", kLongest_s)};
    }
  }
  for (Eigen::Index j = 0; j < kNeckJoints; ++j) {
    double& lower = wanted.neck_lower_rad[j];
    double& upper = wanted.neck_upper_rad[j];
    if (!(lower >= own.lower_rad[j] - kRounded_rad && upper <= own.upper_rad[j] + kRounded_rad &&
          lower <= upper)) {
      return Error{
          ErrorCode::kInvalidArgument,
          fmt::format("joint {} of the neck turns from {:.1f} to {:.1f} degrees: a range lies within", j,
                      own.lower_rad[j] * kDegrees, own.upper_rad[j] * kDegrees)};
    }
    lower = std::max(lower, own.lower_rad[j]);
    upper = std::min(upper, own.upper_rad[j]);
  }
  if (wanted.vergence_rad && !(*wanted.vergence_rad >= own.lower_rad[kVergence] - kRounded_rad &&
                               *wanted.vergence_rad <= own.upper_rad[kVergence] + kRounded_rad)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the vergence is {:.1f} to {:.1f} degrees", own.lower_rad[kVergence] * kDegrees,
                             own.upper_rad[kVergence] * kDegrees)};
  }
  if (!(wanted.eyes_make_up >= 0 && wanted.eyes_make_up <= 1)) {
    return Error{ErrorCode::kInvalidArgument, "the eyes make up for 0 to 1 of the head's turning"};
  }
  if (wanted.saccades && !(wanted.saccades->from_rad >= 0 && wanted.saccades->from_rad <= std::numbers::pi &&
                           wanted.saccades->apart_s >= 0 && wanted.saccades->apart_s <= kLongest_s)) {
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("saccades begin from 0 to 180 degrees, and are 0 to {} s apart at least", kLongest_s)};
  }
  const std::lock_guard lock(mutex_);
  settings_ = wanted;
  return {};
}

HeadRange HeadGaze::range() const {
  HeadRange range = solver_.range();
  range.lower_rad.head<kNeckJoints>() = settings_.neck_lower_rad;
  range.upper_rad.head<kNeckJoints>() = settings_.neck_upper_rad;
  if (settings_.vergence_rad) {
    range.lower_rad[kVersion] = range.upper_rad[kVersion] = 0;
    range.lower_rad[kVergence] = range.upper_rad[kVergence] = *settings_.vergence_rad;
  }
  return range;
}

HeadAngles HeadGaze::with_neck_held(const Eigen::Vector3d& p_Root_m, const TorsoAngles& torso_rad,
                                    const HeadAngles& head_rad) const {
  HeadRange held = range();
  held.lower_rad.head<kNeckJoints>() = held.upper_rad.head<kNeckJoints>() = head_rad.head<kNeckJoints>();
  return solver_.solve(p_Root_m, torso_rad, head_rad, held).head_rad;
}

bool HeadGaze::jumps_to(const Eigen::Vector3d& p_Root_m, const GazeState& now, std::int64_t now_ns) {
  if (!settings_.saccades) return false;
  const auto apart_ns = std::llround(settings_.saccades->apart_s * 1e9);
  if (last_saccade_ns_ && now_ns - *last_saccade_ns_ < apart_ns) return false;
  const Eigen::Vector3d middle_m = (now.X_RootEyes[0].translation() + now.X_RootEyes[1].translation()) / 2;
  const Eigen::Vector3d looks_m = solver_.p_RootFixation_m(now.torso_rad, now.head_rad) - middle_m;
  const Eigen::Vector3d wanted_m = p_Root_m - middle_m;
  const double turn_rad = std::atan2(looks_m.cross(wanted_m).norm(), looks_m.dot(wanted_m));
  if (turn_rad < settings_.saccades->from_rad) return false;
  last_saccade_ns_ = now_ns;
  return true;
}

Status HeadGaze::look_at(const Eigen::Vector3d& p_Root_m) {
  if (!p_Root_m.allFinite() || p_Root_m.norm() > kFarthest_m) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a point to look at is three finite numbers, at most {} m away", kFarthest_m)};
  }
  const Result<GazeState> now = read();
  if (!now) return now.error();
  const std::lock_guard lock(mutex_);
  const HeadAngles from_rad = motion_ ? motion_->sent_rad : now->head_rad;
  const GazeSolution found = solver_.solve(p_Root_m, now->torso_rad, from_rad, range());
  const double error_px = settings_.vergence_rad ? found.middle_error_px : found.error_px;
  if (error_px > kReached_px) {
    return Error{ErrorCode::kFailed,
                 fmt::format("neck and eyes cannot turn so far: the point stays {:.0f} pixels off the middle",
                             error_px)};
  }
  // joints that take no command now refuse the whole motion; where they are moves none
  if (Status able = head_.set_positions(kHead, {from_rad.data(), kHeadJoints}); !able) return able;
  Motion motion{p_Root_m, from_rad, found.head_rad, from_rad, clock_.now_ns()};
  motion.neck_s = std::max(settings_.neck_s, time_of_s(found.head_rad - from_rad, 0, kNeckJoints));
  const HeadAngles first_rad = with_neck_held(p_Root_m, now->torso_rad, from_rad);
  const double shortest_s = time_of_s(first_rad - from_rad, kNeckJoints, kHeadJoints - kNeckJoints);
  motion.eyes_s =
      jumps_to(p_Root_m, *now, motion.begin_ns) ? shortest_s : std::max(settings_.eyes_s, shortest_s);
  motion_ = motion;
  return {};
}

Status HeadGaze::look_at_pixel(int eye, const Eigen::Vector2d& px, double distance_m) {
  if (eye != 0 && eye != 1) {
    return Error{ErrorCode::kInvalidArgument, "there are eye 0, the left one, and eye 1, the right one"};
  }
  if (!px.allFinite() || !eye_camera(body_).contains(px) ||
      !(distance_m > 0.05 && distance_m <= kFarthest_m)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a pixel lies in the picture of {} x {}, and is 0.05 to {} m away",
                             body_.width_px, body_.height_px, kFarthest_m)};
  }
  const Result<GazeState> now = read();
  if (!now) return now.error();
  const Ray sight = sight_of(body_, *now, eye, px);
  return look_at(sight.origin_m + distance_m * sight.direction);
}

Status HeadGaze::look_at_pixels(const Eigen::Vector2d& left_px, const Eigen::Vector2d& right_px) {
  const PinholeCamera camera = eye_camera(body_);
  if (!left_px.allFinite() || !right_px.allFinite() || !camera.contains(left_px) ||
      !camera.contains(right_px)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("pixels lie in the pictures of {} x {}", body_.width_px, body_.height_px)};
  }
  const Result<GazeState> now = read();
  if (!now) return now.error();
  const auto met = triangulate(sight_of(body_, *now, 0, left_px), sight_of(body_, *now, 1, right_px));
  if (met) return look_at(met->p_m);
  return Error{ErrorCode::kInvalidArgument,
               "the lines of sight of these pixels do not meet before the eyes: is one point seen in both?"};
}

Status HeadGaze::look_by_angles(bool relative, const Eigen::Vector3d& angles_rad) {
  const Result<GazeState> now = read();
  if (!now) return now.error();
  const Result<Eigen::Vector3d> p_Root_m = p_at_angles(body_, *now, relative, angles_rad);
  return p_Root_m ? look_at(*p_Root_m) : Status(p_Root_m.error());
}

Status HeadGaze::stop() {
  const std::lock_guard lock(mutex_);
  if (motion_) progress_ = motion_->progress;
  motion_.reset();
  return head_.stop(kHead);
}

Status HeadGaze::step_to(std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  if (!motion_) return {};
  const Result<GazeState> now = read();
  if (!now) return now.error();
  Motion& motion = *motion_;
  // where the point is seen from the torso as it stands now
  motion.end_rad = solver_.solve(motion.p_Root_m, now->torso_rad, motion.end_rad, range()).head_rad;
  const double gone_s = static_cast<double>(now_ns - motion.begin_ns) * 1e-9;
  const auto share = [&](double of_s) { return std::clamp(gone_s / of_s, 0.0, 1.0); };
  motion.sent_rad.head<kNeckJoints>() =
      motion.start_rad.head<kNeckJoints>() +
      minimum_jerk(share(motion.neck_s)) * (motion.end_rad - motion.start_rad).head<kNeckJoints>();
  const HeadAngles held_rad = with_neck_held(motion.p_Root_m, now->torso_rad, motion.sent_rad);
  const HeadAngles eyes_rad = motion.end_rad + settings_.eyes_make_up * (held_rad - motion.end_rad);
  motion.sent_rad.tail<kHeadJoints - kNeckJoints>() =
      motion.start_rad.tail<kHeadJoints - kNeckJoints>() +
      minimum_jerk(share(motion.eyes_s)) * (eyes_rad - motion.start_rad).tail<kHeadJoints - kNeckJoints>();
  motion.progress = share(std::max(motion.neck_s, motion.eyes_s));
  motion.moving = motion.progress < 1 || (now->head_rad - motion.sent_rad).cwiseAbs().maxCoeff() > kStill_rad;
  // a joint that takes no command ends the motion, not the robot
  if (!head_.set_positions(kHead, {motion.sent_rad.data(), kHeadJoints})) motion_.reset();
  return {};
}

}  // namespace nido
