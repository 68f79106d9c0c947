#include "nido/kinematics/chain_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>

namespace nido {
namespace {

constexpr double kPositionUnit_m = 0.001;  // an error of this size costs 1
constexpr double kTurnUnit_rad = 0.01;
constexpr double kMostStep_rad = 0.5;  // of a joint in one iteration
constexpr int kMostJoints = 16;

// no memory is asked for while solving
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostJoints, 1>;
using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostJoints, kMostJoints>;

struct Errors {
  Eigen::Matrix<double, 6, 1> value = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, Eigen::Dynamic> slope;
  double position_m = 0;
  double turn_rad = 0;
  double cost = 0;
};

struct Problem {
  const SerialChain& chain;
  const ChainGoal& goal;
  Vector lower;
  Vector upper;
  Vector rest;
  double rest_stiffness;
  const ChainOptions& options;

  void errors_at(const Eigen::VectorXd& q, Errors& errors) const {
    const Eigen::Isometry3d X = chain.X_RootTip(q, errors.slope);
    const Eigen::Vector3d off_m = goal.X_RootTip.translation() - X.translation();
    errors.position_m = off_m.norm();
    errors.value.head<3>() = off_m / kPositionUnit_m;
    errors.slope.topRows<3>() /= kPositionUnit_m;
    if (goal.with_orientation) {
      const Eigen::AngleAxisd turn(goal.X_RootTip.linear() * X.linear().transpose());
      errors.turn_rad = std::abs(turn.angle());
      errors.value.tail<3>() = turn.angle() * turn.axis() / kTurnUnit_rad;
      errors.slope.bottomRows<3>() /= kTurnUnit_rad;
    } else {
      errors.turn_rad = 0;
      errors.value.tail<3>().setZero();
      errors.slope.bottomRows<3>().setZero();
    }
    errors.cost = errors.value.squaredNorm() + rest_stiffness * (q - rest).squaredNorm();
  }

  [[nodiscard]] bool is_met(const Errors& errors) const {
    return errors.position_m < options.position_enough_m && errors.turn_rad < options.turn_enough_rad;
  }

  // goes downhill from q; leaves q and its errors
  void descend(Eigen::VectorXd& q, Errors& errors) const {
    const Eigen::Index n = q.size();
    q = q.cwiseMax(lower).cwiseMin(upper);
    errors_at(q, errors);
    Errors there;
    there.slope.resize(6, n);
    Eigen::VectorXd moved(n);
    double damping = 1.0;
    int settled = 0;
    for (int iteration = 0; iteration < options.iterations; ++iteration) {
      const Vector downhill = errors.slope.transpose() * errors.value + rest_stiffness * (rest - q);
      Square stiffness = errors.slope.transpose() * errors.slope;
      stiffness.diagonal().array() += rest_stiffness + damping;
      std::array<bool, kMostJoints> fixed{};
      Vector step(n);
      for (Eigen::Index pass = 0; pass < n; ++pass) {
        Square matrix = stiffness;
        Vector force = downhill;
        for (Eigen::Index j = 0; j < n; ++j) {
          const bool stands = upper[j] <= lower[j];
          if (!stands && !fixed[static_cast<std::size_t>(j)]) continue;
          matrix.row(j).setZero();
          matrix.col(j).setZero();
          matrix(j, j) = 1.0;
          force[j] = 0.0;
        }
        step = matrix.llt().solve(force);
        bool again = false;
        for (Eigen::Index j = 0; j < n; ++j) {
          bool& is_fixed = fixed[static_cast<std::size_t>(j)];
          const bool outwards = (q[j] <= lower[j] && step[j] < 0) || (q[j] >= upper[j] && step[j] > 0);
          if (!is_fixed && outwards) is_fixed = again = true;
        }
        if (!again) break;
      }
      const double largest = step.cwiseAbs().maxCoeff();
      if (!(largest > 1e-7)) break;
      if (largest > kMostStep_rad) step *= kMostStep_rad / largest;
      moved = (q + step).cwiseMax(lower).cwiseMin(upper);
      errors_at(moved, there);
      if (there.cost < errors.cost) {
        const bool little = errors.cost - there.cost < 1e-4 * errors.cost;
        q.swap(moved);
        std::swap(errors, there);
        damping = std::max(1e-4, 0.2 * damping);
        settled = little ? settled + 1 : 0;
        // what is met already gains nothing from more rest; what goes no further is a valley
        if (settled >= (is_met(errors) ? 1 : 4)) break;
      } else {
        damping = std::max(1e-2, 8.0 * damping);
        if (damping > 1e10) break;
      }
    }
  }
};

}  // namespace

Result<SerialChain> SerialChain::create(const RobotModel& model, const std::string& tip_link,
                                        const std::vector<std::string>& axes) {
  const Result<int> tip = model.link_index(tip_link);
  if (!tip) return tip.error();
  if (axes.empty() || axes.size() > static_cast<std::size_t>(kMostJoints)) {
    return Error{ErrorCode::kInvalidArgument, "a chain has 1 to " + std::to_string(kMostJoints) +
                                                  " joints, not " + std::to_string(axes.size())};
  }
  // which axis moves a hinge
  std::vector<Eigen::Index> joint_of_hinge(model.hinges().size(), -1);
  SerialChain chain;
  const auto count = static_cast<Eigen::Index>(axes.size());
  chain.lower_rad_.resize(count);
  chain.upper_rad_.resize(count);
  chain.velocity_rad_s_.resize(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const std::string& name = axes[static_cast<std::size_t>(j)];
    const Result<int> index = model.axis_index(name);
    if (!index) return index.error();
    const Axis& axis = model.axis(*index);
    if (axis.hinges.size() != 1 || axis.hinges[0].multiplier != 1 || axis.hinges[0].offset_rad != 0 ||
        joint_of_hinge[static_cast<std::size_t>(axis.hinges[0].hinge)] >= 0) {
      return Error{ErrorCode::kInvalidArgument,
                   "axis " + name + " shares its hinges with others: it cannot be one of a chain"};
    }
    joint_of_hinge[static_cast<std::size_t>(axis.hinges[0].hinge)] = j;
    chain.lower_rad_[j] = axis.lower_rad;
    chain.upper_rad_[j] = axis.upper_rad;
    chain.velocity_rad_s_[j] = axis.velocity_rad_s;
  }
  Eigen::Isometry3d X_JointBelow = Eigen::Isometry3d::Identity();
  bool is_tip = true;
  for (int link = *tip; link >= 0; link = model.links()[static_cast<std::size_t>(link)].parent) {
    const BodyLink& body = model.links()[static_cast<std::size_t>(link)];
    const Eigen::Index joint = body.hinge < 0 ? -1 : joint_of_hinge[static_cast<std::size_t>(body.hinge)];
    if (body.hinge >= 0 && joint < 0) {
      return Error{ErrorCode::kInvalidArgument,
                   "joint " + model.hinges()[static_cast<std::size_t>(body.hinge)].name +
                       " lies between the root and " + tip_link + " and is not in the chain"};
    }
    if (joint < 0) {
      X_JointBelow = body.X_ParentChild0 * X_JointBelow;
      continue;
    }
    (is_tip ? chain.X_LastTip_ : chain.steps_.back().X_ParentJoint) = X_JointBelow;
    is_tip = false;
    chain.steps_.push_back({Eigen::Isometry3d::Identity(), joint});
    X_JointBelow = body.X_ParentChild0;
  }
  if (chain.steps_.size() != axes.size()) {
    return Error{ErrorCode::kInvalidArgument, "of the " + std::to_string(axes.size()) + " joints only " +
                                                  std::to_string(chain.steps_.size()) +
                                                  " lie between the root and " + tip_link};
  }
  chain.steps_.back().X_ParentJoint = X_JointBelow;
  std::reverse(chain.steps_.begin(), chain.steps_.end());
  return chain;
}

Eigen::Isometry3d SerialChain::X_RootTip(const Eigen::VectorXd& q_rad) const {
  return X_RootLink(q_rad, size() - 1);
}

Eigen::Isometry3d SerialChain::X_RootLink(const Eigen::VectorXd& q_rad, Eigen::Index joint_from_root) const {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  const auto joints = static_cast<std::size_t>(joint_from_root) + 1;
  for (std::size_t i = 0; i < joints; ++i) {
    X = X * steps_[i].X_ParentJoint * Eigen::AngleAxisd(q_rad[steps_[i].joint], Eigen::Vector3d::UnitZ());
  }
  return X * (joints < steps_.size() ? steps_[joints].X_ParentJoint : X_LastTip_);
}

SerialChain SerialChain::with_tip(const Eigen::Isometry3d& X_TipNew) const {
  SerialChain other = *this;
  other.X_LastTip_ = X_LastTip_ * X_TipNew;
  return other;
}

Eigen::Isometry3d SerialChain::X_RootTip(const Eigen::VectorXd& q_rad,
                                         Eigen::Matrix<double, 6, Eigen::Dynamic>& jacobian) const {
  std::array<Eigen::Vector3d, kMostJoints> axis;
  std::array<Eigen::Vector3d, kMostJoints> origin_m;
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    X = X * steps_[i].X_ParentJoint * Eigen::AngleAxisd(q_rad[steps_[i].joint], Eigen::Vector3d::UnitZ());
    axis[i] = X.linear().col(2);
    origin_m[i] = X.translation();
  }
  X = X * X_LastTip_;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    jacobian.col(steps_[i].joint).head<3>() = axis[i].cross(X.translation() - origin_m[i]);
    jacobian.col(steps_[i].joint).tail<3>() = axis[i];
  }
  return X;
}

ChainSolution solve_chain(const SerialChain& chain, const ChainGoal& goal, const Eigen::VectorXd& start_rad,
                          const ChainOptions& options) {
  const Eigen::Index n = chain.size();
  const Eigen::VectorXd& lower_rad = options.lower_rad ? *options.lower_rad : chain.lower_rad();
  const Eigen::VectorXd& upper_rad = options.upper_rad ? *options.upper_rad : chain.upper_rad();
  const Eigen::VectorXd middle_rad = (lower_rad + upper_rad) / 2;
  Problem problem{chain,
                  goal,
                  (lower_rad.array() + options.margin_rad).min(middle_rad.array()),
                  (upper_rad.array() - options.margin_rad).max(middle_rad.array()),
                  options.rest_rad ? *options.rest_rad : start_rad,
                  options.rest_weight * options.rest_weight,
                  options};
  for (Eigen::Index j = 0; j < n; ++j) {
    if (!options.locked.empty() && options.locked[static_cast<std::size_t>(j)]) {
      problem.lower[j] = problem.upper[j] = start_rad[j];
    }
  }
  std::mt19937_64 random(options.seed);
  Errors errors;
  errors.slope.resize(6, n);
  ChainSolution best;
  double best_cost = 0;
  Eigen::VectorXd q(n);
  for (int start = 0; start < options.starts; ++start) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const double share = std::uniform_real_distribution<double>(0, 1)(random);
      q[j] = start == 0 ? start_rad[j] : problem.lower[j] + share * (problem.upper[j] - problem.lower[j]);
    }
    problem.descend(q, errors);
    // nearness to the goal first
    const double cost = errors.value.squaredNorm();
    if (start == 0 || cost < best_cost) {
      best_cost = cost;
      best = {q, errors.position_m, errors.turn_rad, start + 1};
    }
    best.starts = start + 1;
    if (problem.is_met(errors)) break;
  }
  return best;
}

}  // namespace nido
