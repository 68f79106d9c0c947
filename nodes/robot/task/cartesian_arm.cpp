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
constexpr double kRounded_rad = 1e-6;    // limits that came as degrees
constexpr double kMostBehind_m = 0.005;  // of a speed that joints cannot follow
constexpr double kMostBehind_rad = 0.05;
constexpr double kMostSpeed_m_s = 2;
constexpr double kMostTurn_rad_s = 10;
constexpr double kLongestSpeed_s = 60;
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
  return std::unique_ptr<CartesianArm>(new CartesianArm(*chain, arm, torso, with_torso, clock));
}

CartesianArm::CartesianArm(const SerialChain& chain, IControlBoard& arm, IControlBoard& torso,
                           bool with_torso, const IClock& clock)
    : palm_(chain), arm_(arm), torso_(torso), with_torso_(with_torso), clock_(clock), chain_(chain) {
  const Eigen::Index n = chain.size();
  settings_.moves.assign(static_cast<std::size_t>(n), true);
  for (Eigen::Index j = 0; j < kTorsoJoints; ++j) settings_.moves[static_cast<std::size_t>(j)] = with_torso;
  settings_.lower_rad.assign(chain.lower_rad().data(), chain.lower_rad().data() + n);
  settings_.upper_rad.assign(chain.upper_rad().data(), chain.upper_rad().data() + n);
  settings_.rest_rad.resize(static_cast<std::size_t>(n));
}

Result<CartesianArm::Posture> CartesianArm::read() const {
  const Result<JointReading> torso = torso_.read_joints();
  if (!torso) return torso.error();
  const Result<JointReading> arm = arm_.read_joints();
  if (!arm) return arm.error();
  Posture posture{Eigen::VectorXd(kTorsoJoints + kArmJoints), Eigen::VectorXd(kTorsoJoints + kArmJoints),
                  arm->stamp_ns};
  const auto copy = [&](const JointReading& from, Eigen::Index count, Eigen::Index at) {
    posture.q_rad.segment(at, count) = Eigen::Map<const Eigen::VectorXd>(from.position_rad.data(), count);
    posture.velocity_rad_s.segment(at, count) =
        Eigen::Map<const Eigen::VectorXd>(from.velocity_rad_s.data(), count);
  };
  copy(*torso, kTorsoJoints, 0);
  copy(*arm, kArmJoints, kTorsoJoints);
  return posture;
}

bool CartesianArm::torso_moves() const {
  return std::find(settings_.moves.begin(), settings_.moves.begin() + kTorsoJoints, true) !=
         settings_.moves.begin() + kTorsoJoints;
}

ChainOptions CartesianArm::options(const Eigen::VectorXd& from_rad) const {
  ChainOptions options;
  const Eigen::Index n = chain_.size();
  options.lower_rad = Eigen::Map<const Eigen::VectorXd>(settings_.lower_rad.data(), n);
  options.upper_rad = Eigen::Map<const Eigen::VectorXd>(settings_.upper_rad.data(), n);
  options.rest_rad = from_rad;
  options.locked.assign(static_cast<std::size_t>(n), false);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto at = static_cast<std::size_t>(j);
    options.locked[at] = !settings_.moves[at];
    if (settings_.rest_rad[at]) (*options.rest_rad)[j] = *settings_.rest_rad[at];
  }
  return options;
}

ChainSolution CartesianArm::solve(const CartesianGoal& goal, const Eigen::VectorXd& from_rad) const {
  return solve_chain(chain_, {goal.X_RootPalm, goal.with_orientation}, from_rad, options(from_rad));
}

Result<CartesianState> CartesianArm::state() const {
  const auto now = read();
  if (!now) return now.error();
  const std::lock_guard lock(mutex_);
  CartesianState state;
  state.stamp_ns = now->stamp_ns;
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, chain_.size());
  state.X_RootPalm = chain_.X_RootTip(now->q_rad, jacobian);
  state.velocities_rad_s.assign(now->velocity_rad_s.begin(), now->velocity_rad_s.end());
  const Eigen::Matrix<double, 6, 1> speed = jacobian * now->velocity_rad_s;
  state.v_m_s = speed.head<3>();
  state.w_rad_s = speed.tail<3>();
  state.moving = motion_.has_value();
  state.motion = motions_;
  state.progress = motion_ ? motion_->progress : progress_;
  if (goal_) {
    state.position_error_m = (goal_->X_RootPalm.translation() - state.X_RootPalm.translation()).norm();
    if (goal_->with_orientation) state.turn_error_rad = turn_between(goal_->X_RootPalm, state.X_RootPalm);
  }
  return state;
}

Result<Eigen::Isometry3d> CartesianArm::X_RootLink(int joint_from_root) const {
  if (joint_from_root < 0 || joint_from_root >= palm_.size()) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the chain's joints are 0 to {}", palm_.size() - 1)};
  }
  const auto now = read();
  if (!now) return now.error();
  const std::lock_guard lock(mutex_);
  return chain_.X_RootLink(now->q_rad, joint_from_root);
}

Result<CartesianSettings> CartesianArm::settings() const {
  const std::lock_guard lock(mutex_);
  return settings_;
}

Status CartesianArm::set_settings(const CartesianSettings& settings) {
  const auto n = static_cast<std::size_t>(palm_.size());
  if (settings.moves.size() != n || settings.lower_rad.size() != n || settings.upper_rad.size() != n ||
      settings.rest_rad.size() != n) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("settings are of the chain's {} joints", n)};
  }
  if (Status valid = check({settings.X_PalmTip}); !valid) return valid;
  CartesianSettings wanted = settings;
  for (std::size_t j = 0; j < n; ++j) {
    const double lower = palm_.lower_rad()[static_cast<Eigen::Index>(j)];
    const double upper = palm_.upper_rad()[static_cast<Eigen::Index>(j)];
    const auto within = [&](double rad) {
      return rad >= lower - kRounded_rad && rad <= upper + kRounded_rad;
    };
    if (!within(wanted.lower_rad[j]) || !within(wanted.upper_rad[j]) ||
        wanted.lower_rad[j] > wanted.upper_rad[j] || (wanted.rest_rad[j] && !within(*wanted.rest_rad[j]))) {
      return Error{
          ErrorCode::kInvalidArgument,
          fmt::format("joint {} of the chain turns from {:.1f} to {:.1f} degrees: limits and rest lie "
                      "within",
                      j, lower * 180 / std::numbers::pi, upper * 180 / std::numbers::pi)};
    }
    if (j < kTorsoJoints && wanted.moves[j] && !with_torso_) {
      return Error{ErrorCode::kInvalidArgument, "this arm reaches without the torso"};
    }
    wanted.lower_rad[j] = std::max(wanted.lower_rad[j], lower);
    wanted.upper_rad[j] = std::min(wanted.upper_rad[j], upper);
  }
  const std::lock_guard lock(mutex_);
  if (!wanted.X_PalmTip.isApprox(settings_.X_PalmTip)) {
    if (motion_)
      return Error{ErrorCode::kFailed, "the hand is on its way: stop it before it gets another tip"};
    chain_ = palm_.with_tip(wanted.X_PalmTip);
    goal_.reset();
  }
  settings_ = std::move(wanted);
  return {};
}

Result<CartesianPlan> CartesianArm::plan(const CartesianGoal& goal) const {
  if (Status valid = check(goal); !valid) return valid.error();
  const auto now = read();
  if (!now) return now.error();
  const std::lock_guard lock(mutex_);
  const ChainSolution found = solve(goal, now->q_rad);
  return CartesianPlan{{found.q_rad.begin(), found.q_rad.end()},
                       found.position_error_m,
                       found.turn_error_rad,
                       chain_.X_RootTip(found.q_rad)};
}

Status CartesianArm::go_to(const CartesianGoal& goal) {
  if (Status valid = check(goal); !valid) return valid;
  const auto now = read();
  if (!now) return now.error();
  const std::lock_guard lock(mutex_);
  // a motion under way goes over into the new one without a step
  const Eigen::VectorXd from_rad = motion_ ? motion_->sent_rad : now->q_rad;
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
  ++motions_;
  goal_ = goal;
  return {};
}

Status CartesianArm::go_on(const Eigen::Vector3d& v_m_s, const Eigen::Vector3d& w_rad_s, double for_s) {
  if (!(v_m_s.norm() <= kMostSpeed_m_s && w_rad_s.norm() <= kMostTurn_rad_s)) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("a hand goes at most {} m/s and turns {} rad/s",
                                                          kMostSpeed_m_s, kMostTurn_rad_s)};
  }
  if (!(for_s > 0 && for_s <= kLongestSpeed_s)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a speed of the hand holds for up to {} s", kLongestSpeed_s)};
  }
  const auto now = read();
  if (!now) return now.error();
  const std::lock_guard lock(mutex_);
  const Eigen::VectorXd from_rad = motion_ ? motion_->sent_rad : now->q_rad;
  if (Status able = stream(from_rad); !able) return able;
  if (!motion_ || !motion_->speed) {
    CartesianGoal here;
    here.X_RootPalm = chain_.X_RootTip(from_rad);
    motion_ = Motion{here, here.X_RootPalm, from_rad, from_rad, from_rad};
    ++motions_;
    goal_.reset();
  }
  // one that goes on already goes on from where it was to be
  motion_->begin_ns = clock_.now_ns();
  motion_->duration_s = for_s;
  motion_->speed.emplace() << v_m_s, w_rad_s;
  return {};
}

void CartesianArm::end_motion() {
  if (motion_) progress_ = motion_->progress;
  motion_.reset();
}

Status CartesianArm::stop() {
  const std::lock_guard lock(mutex_);
  end_motion();
  ++motions_;
  if (Status stopped = arm_.stop(kArm); !stopped) return stopped;
  return torso_moves() ? torso_.stop(kTorso) : Status();
}

Status CartesianArm::stream(const Eigen::VectorXd& q_rad) {
  if (torso_moves()) {
    if (Status sent = torso_.set_positions(kTorso, {q_rad.data(), kTorsoJoints}); !sent) return sent;
  }
  return arm_.set_positions(kArm, {q_rad.data() + kTorsoJoints, kArmJoints});
}

Status CartesianArm::settle(const Eigen::VectorXd& q_rad) {
  if (torso_moves()) {
    if (Status sent = torso_.move_to(kTorso, {q_rad.data(), kTorsoJoints}); !sent) return sent;
  }
  return arm_.move_to(kArm, {q_rad.data() + kTorsoJoints, kArmJoints});
}

Eigen::VectorXd CartesianArm::on_its_way(Motion& motion, std::int64_t now_ns, double dt_s) const {
  ChainGoal place;
  ChainOptions way = options(motion.sent_rad);
  way.iterations = 10;
  way.starts = 1;
  motion.progress =
      std::clamp(static_cast<double>(now_ns - motion.begin_ns) * 1e-9 / motion.duration_s, 0.0, 1.0);
  if (motion.progress >= 1 && motion.speed) motion.end_rad = motion.sent_rad;
  if (motion.progress >= 1) return motion.end_rad;
  if (motion.speed) {
    // where the tip is to be goes on from where it was to be, so that no error adds up
    Eigen::Isometry3d& X = motion.goal.X_RootPalm;
    const Eigen::Vector3d turn_rad = motion.speed->tail<3>() * dt_s;
    X.translation() += motion.speed->head<3>() * dt_s;
    if (turn_rad.norm() > 0) {
      X.linear() = Eigen::AngleAxisd(turn_rad.norm(), turn_rad.normalized()).toRotationMatrix() * X.linear();
    }
    place.X_RootTip = X;
    const ChainSolution found = solve_chain(chain_, place, motion.sent_rad, way);
    if (found.position_error_m > kMostBehind_m || found.turn_error_rad > kMostBehind_rad) {
      motion.is_held_up = true;
      motion.end_rad = motion.sent_rad;
      return motion.sent_rad;
    }
    return found.q_rad;
  }
  // the hand's straight line; what it leaves free goes evenly from posture to posture, so that the line
  // ends in the planned one, also when it has led past a limit or a singularity
  const double s = minimum_jerk(motion.progress);
  place.X_RootTip.translation() =
      (1 - s) * motion.X_RootStart.translation() + s * motion.goal.X_RootPalm.translation();
  const Eigen::Quaterniond from(motion.X_RootStart.linear());
  const Eigen::Quaterniond to(motion.goal.with_orientation ? motion.goal.X_RootPalm.linear()
                                                           : chain_.X_RootTip(motion.end_rad).linear());
  place.X_RootTip.linear() = from.slerp(s, to).toRotationMatrix();
  way.rest_rad = motion.start_rad + s * (motion.end_rad - motion.start_rad);
  way.rest_weight = 2.0;
  // a joint that is to come back within its range does so on the way
  way.lower_rad = way.lower_rad->cwiseMin(motion.start_rad);
  way.upper_rad = way.upper_rad->cwiseMax(motion.start_rad);
  return solve_chain(chain_, place, motion.sent_rad, way).q_rad;
}

Status CartesianArm::step_to(std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  const double dt_s = std::clamp(static_cast<double>(now_ns - stepped_ns_) * 1e-9, 0.0, 0.1);
  stepped_ns_ = now_ns;
  if (!motion_) return {};
  Motion& motion = *motion_;
  const Eigen::VectorXd wanted = on_its_way(motion, now_ns, dt_s);
  const Eigen::VectorXd reach = chain_.velocity_rad_s() * dt_s;
  motion.sent_rad = wanted.cwiseMax(motion.sent_rad - reach).cwiseMin(motion.sent_rad + reach);
  const bool arrived = (motion.progress >= 1 || motion.is_held_up) &&
                       (motion.end_rad - motion.sent_rad).cwiseAbs().maxCoeff() < kArrived_rad;
  // a joint that takes no command ends the motion, not the robot
  const Status sent = arrived ? settle(motion.end_rad) : stream(motion.sent_rad);
  if (arrived || !sent) end_motion();
  return {};
}

}  // namespace nido
