#include "task/cartesian_arm.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace nido {
namespace {

constexpr Eigen::Index kTorsoJoints = 3;
constexpr Eigen::Index kArmJoints = 7;
constexpr double kPeakOfMinimumJerk = 1.875;
constexpr double kShareOfTopSpeed = 0.5;
constexpr double kTopSpeed_m_s = 0.4;  // of the hand, unless a duration is asked for
constexpr double kShortest_s = 0.3;
constexpr double kReached_m = 0.002;
constexpr double kReached_rad = std::numbers::pi / 180.0;
constexpr double kArrived_rad = 1e-4;
constexpr std::array<int, 3> kTorso = {0, 1, 2};
constexpr std::array<int, 7> kArm = {0, 1, 2, 3, 4, 5, 6};

double minimum_jerk(double s) { return s * s * s * (10 + s * (-15 + 6 * s)); }

double turn_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return std::abs(Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle());
}

Status check(const CartesianGoal& goal) {
  if (!goal.X_RootPalm.matrix().allFinite() || !std::isfinite(goal.duration_s) || goal.duration_s < 0 ||
      goal.duration_s > 3600) {
    return Error{ErrorCode::kInvalidArgument,
                 "a goal of the hand has finite numbers and a duration of 0 to 3600 s"};
  }
  const Eigen::Matrix3d R = goal.X_RootPalm.linear();
  if (!(R.transpose() * R).isIdentity(1e-6) || R.determinant() < 0) {
    return Error{ErrorCode::kInvalidArgument, "the orientation of the goal is no turn"};
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<CartesianArm>> CartesianArm::create(const RobotModel& model, const std::string& side,
                                                           IControlBoard& arm, IControlBoard& torso,
                                                           bool with_torso, const IClock& clock) {
  const Result<HandInfo> hand = model.hand(side);
  if (!hand) return hand.error();
  if (arm.axes() < kArmJoints || torso.axes() < kTorsoJoints) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("an arm has {} joints and a torso {}: these boards have {} and {}", kArmJoints,
                             kTorsoJoints, arm.axes(), torso.axes())};
  }
  // joints by the model's names, in the order of the parts: boards of other robots name them otherwise
  std::vector<std::string> names;
  for (const auto& [part, count] :
       {std::pair<std::string, Eigen::Index>{"torso", kTorsoJoints}, {side + "_arm", kArmJoints}}) {
    const Result<int> index = model.part_index(part);
    if (!index) return index.error();
    const std::vector<Axis>& axes = model.parts()[static_cast<std::size_t>(*index)].axes;
    for (Eigen::Index j = 0; j < count; ++j) names.push_back(axes.at(static_cast<std::size_t>(j)).name);
  }
  Result<SerialChain> chain =
      SerialChain::create(model, model.links()[static_cast<std::size_t>(hand->frame)].name, names);
  if (!chain) return chain.error();
  return std::unique_ptr<CartesianArm>(
      new CartesianArm(std::move(chain).value(), arm, torso, with_torso, clock));
}

Result<std::pair<Eigen::VectorXd, std::int64_t>> CartesianArm::read() const {
  const Result<JointReading> torso = torso_.read_joints();
  if (!torso) return torso.error();
  const Result<JointReading> arm = arm_.read_joints();
  if (!arm) return arm.error();
  Eigen::VectorXd q(kTorsoJoints + kArmJoints);
  for (Eigen::Index j = 0; j < kTorsoJoints; ++j) q[j] = torso->position_rad[static_cast<std::size_t>(j)];
  for (Eigen::Index j = 0; j < kArmJoints; ++j) {
    q[kTorsoJoints + j] = arm->position_rad[static_cast<std::size_t>(j)];
  }
  return std::pair{q, arm->stamp_ns};
}

ChainSolution CartesianArm::solve(const CartesianGoal& goal, const Eigen::VectorXd& from_rad) const {
  ChainOptions options;
  options.locked.assign(static_cast<std::size_t>(chain_.size()), false);
  for (Eigen::Index j = 0; j < kTorsoJoints; ++j) options.locked[static_cast<std::size_t>(j)] = !with_torso_;
  return solve_chain(chain_, {goal.X_RootPalm, goal.with_orientation}, from_rad, options);
}

Result<CartesianState> CartesianArm::state() const {
  const auto now = read();
  if (!now) return now.error();
  const std::lock_guard lock(mutex_);
  CartesianState state;
  state.stamp_ns = now->second;
  state.X_RootPalm = chain_.X_RootTip(now->first);
  state.moving = motion_.has_value();
  if (goal_) {
    state.position_error_m = (goal_->X_RootPalm.translation() - state.X_RootPalm.translation()).norm();
    if (goal_->with_orientation) state.turn_error_rad = turn_between(goal_->X_RootPalm, state.X_RootPalm);
  }
  return state;
}

Result<CartesianPlan> CartesianArm::plan(const CartesianGoal& goal) const {
  if (Status valid = check(goal); !valid) return valid.error();
  const auto now = read();
  if (!now) return now.error();
  const ChainSolution found = solve(goal, now->first);
  CartesianPlan plan;
  const Eigen::Index first = with_torso_ ? 0 : kTorsoJoints;
  plan.joints_rad.assign(found.q_rad.data() + first, found.q_rad.data() + found.q_rad.size());
  plan.position_error_m = found.position_error_m;
  plan.turn_error_rad = found.turn_error_rad;
  return plan;
}

Status CartesianArm::go_to(const CartesianGoal& goal) {
  if (Status valid = check(goal); !valid) return valid;
  const auto now = read();
  if (!now) return now.error();
  const std::lock_guard lock(mutex_);
  // a motion under way goes over into the new one without a step
  const Eigen::VectorXd from_rad = motion_ ? motion_->sent_rad : now->first;
  const ChainSolution found = solve(goal, from_rad);
  if (found.position_error_m > kReached_m || found.turn_error_rad > kReached_rad) {
    return Error{
        ErrorCode::kFailed,
        fmt::format("the hand cannot get there: the nearest posture is {:.0f} mm and {:.1f} degrees off",
                    found.position_error_m * 1e3, found.turn_error_rad * 180 / std::numbers::pi)};
  }
  // joints that take no command now refuse the whole motion; where they are moves none
  if (Status able = stream(from_rad); !able) return able;
  Motion motion{goal,       chain_.X_RootTip(from_rad), from_rad, found.q_rad, from_rad, clock_.now_ns(),
                kShortest_s};
  const Eigen::ArrayXd speeds = kShareOfTopSpeed * chain_.velocity_rad_s().array();
  const double joints_s = ((found.q_rad - from_rad).array().abs() / speeds).maxCoeff();
  const double hand_s =
      (goal.X_RootPalm.translation() - motion.X_RootStart.translation()).norm() / kTopSpeed_m_s;
  motion.duration_s = goal.duration_s > 0
                          ? std::max(goal.duration_s, kPeakOfMinimumJerk * kShareOfTopSpeed * joints_s)
                          : std::max(kShortest_s, kPeakOfMinimumJerk * std::max(joints_s, hand_s));
  motion_ = motion;
  goal_ = goal;
  return {};
}

Status CartesianArm::stop() {
  const std::lock_guard lock(mutex_);
  motion_.reset();
  if (Status stopped = arm_.stop(kArm); !stopped) return stopped;
  return with_torso_ ? torso_.stop(kTorso) : Status();
}

Status CartesianArm::stream(const Eigen::VectorXd& q_rad) {
  if (with_torso_) {
    if (Status sent = torso_.set_positions(kTorso, {q_rad.data(), kTorsoJoints}); !sent) return sent;
  }
  return arm_.set_positions(kArm, {q_rad.data() + kTorsoJoints, kArmJoints});
}

Status CartesianArm::settle(const Eigen::VectorXd& q_rad) {
  if (with_torso_) {
    if (Status sent = torso_.move_to(kTorso, {q_rad.data(), kTorsoJoints}); !sent) return sent;
  }
  return arm_.move_to(kArm, {q_rad.data() + kTorsoJoints, kArmJoints});
}

Status CartesianArm::step_to(std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  const double dt_s = std::clamp(static_cast<double>(now_ns - stepped_ns_) * 1e-9, 0.0, 0.1);
  stepped_ns_ = now_ns;
  if (!motion_) return {};
  Motion& motion = *motion_;
  const double share =
      std::clamp(static_cast<double>(now_ns - motion.begin_ns) * 1e-9 / motion.duration_s, 0.0, 1.0);
  const double s = minimum_jerk(share);
  Eigen::VectorXd wanted = motion.end_rad;
  if (share < 1) {
    // the hand's straight line; what it leaves free goes evenly from posture to posture, so that the line
    // ends in the planned one, also when it has led past a limit or a singularity
    ChainGoal place;
    place.X_RootTip.translation() =
        (1 - s) * motion.X_RootStart.translation() + s * motion.goal.X_RootPalm.translation();
    const Eigen::Quaterniond from(motion.X_RootStart.linear());
    const Eigen::Quaterniond to(motion.goal.with_orientation ? motion.goal.X_RootPalm.linear()
                                                             : chain_.X_RootTip(motion.end_rad).linear());
    place.X_RootTip.linear() = from.slerp(s, to).toRotationMatrix();
    ChainOptions options;
    options.locked.assign(static_cast<std::size_t>(chain_.size()), false);
    for (Eigen::Index j = 0; j < kTorsoJoints; ++j) {
      options.locked[static_cast<std::size_t>(j)] = !with_torso_;
    }
    options.rest_rad = motion.start_rad + s * (motion.end_rad - motion.start_rad);
    options.rest_weight = 2.0;
    options.iterations = 10;
    options.starts = 1;
    wanted = solve_chain(chain_, place, motion.sent_rad, options).q_rad;
  }
  const Eigen::VectorXd reach = chain_.velocity_rad_s() * dt_s;
  motion.sent_rad = wanted.cwiseMax(motion.sent_rad - reach).cwiseMin(motion.sent_rad + reach);
  const bool arrived = share >= 1 && (motion.end_rad - motion.sent_rad).cwiseAbs().maxCoeff() < kArrived_rad;
  // a joint that takes no command ends the motion, not the robot
  const Status sent = arrived ? settle(motion.end_rad) : stream(motion.sent_rad);
  if (arrived || !sent) motion_.reset();
  return {};
}

}  // namespace nido
