#include "nido/reach/inverse_kinematics.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace nido::reach {
namespace {

constexpr double kPositionUnit_m = 0.002;  // an error of this size costs 1
constexpr double kTurnUnit_rad = 0.02;
constexpr double kMostStep_rad = 0.25;  // of a joint in one iteration

Eigen::Vector3d turn_from_to(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  const Eigen::AngleAxisd turn(to * from.transpose());
  return turn.angle() * turn.axis();
}

// Weighted errors of a posture and their slopes.
struct Errors {
  Eigen::Matrix<double, 6, 1> value;
  Jacobian slope;
  Eigen::Vector3d position_m;
  Eigen::Vector3d turn_rad;
  double cost = 0.0;
};

Errors errors_at(const ArmChain& chain, const SeenOffset& offset, const PalmGoal& goal, const Joints& q,
                 const SolverOptions& options) {
  Errors errors;
  const Eigen::Isometry3d X = chain.X_RootPalm(q, errors.slope);
  const Eigen::Vector3d lever = X.linear() * goal.p_PalmTool_m;
  for (int joint = 0; joint < kJoints; ++joint) {  // from the palm's origin to the tool point
    errors.slope.col(joint).head<3>() += errors.slope.col(joint).tail<3>().cross(lever);
  }
  errors.position_m = goal.X_RootPalm * goal.p_PalmTool_m - (X.translation() + lever + offset(q));
  errors.turn_rad = turn_from_to(X.linear(), goal.X_RootPalm.linear()).cwiseProduct(goal.turn_weight);
  errors.value << errors.position_m / kPositionUnit_m, errors.turn_rad / kTurnUnit_rad;
  errors.slope.topRows<3>() /= kPositionUnit_m;
  for (int axis = 0; axis < 3; ++axis) errors.slope.row(3 + axis) *= goal.turn_weight(axis) / kTurnUnit_rad;
  errors.cost = errors.value.squaredNorm() + options.rest_weight.cwiseProduct(q - options.rest).squaredNorm();
  return errors;
}

}  // namespace

PalmSolution solve_palm(const ArmChain& chain, const SeenOffset& offset, const PalmGoal& goal,
                        const Joints& start, const SolverOptions& options) {
  const Joints lower = chain.min().cwiseMax(options.min).array() + options.limit_margin_rad;
  const Joints upper = chain.max().cwiseMin(options.max).array() - options.limit_margin_rad;
  const Joints rest_stiffness = options.rest_weight.cwiseAbs2();
  Joints q = start.cwiseMax(lower).cwiseMin(upper);
  Errors errors = errors_at(chain, offset, goal, q, options);
  double damping = 1.0;
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    const Joints downhill =
        errors.slope.transpose() * errors.value + rest_stiffness.cwiseProduct(options.rest - q);
    Eigen::Matrix<double, kJoints, kJoints> stiffness = errors.slope.transpose() * errors.slope;
    stiffness.diagonal() += rest_stiffness;
    stiffness.diagonal().array() += damping;
    // a joint at its limit that is pushed outwards is left out
    std::array<bool, kJoints> fixed{};
    Joints step = Joints::Zero();
    for (int pass = 0; pass < kJoints; ++pass) {
      auto matrix = stiffness;
      Joints force = downhill;
      for (int joint = 0; joint < kJoints; ++joint) {
        if (!fixed[static_cast<std::size_t>(joint)]) continue;
        matrix.row(joint).setZero();
        matrix.col(joint).setZero();
        matrix(joint, joint) = 1.0;
        force(joint) = 0.0;
      }
      step = matrix.ldlt().solve(force);
      bool again = false;
      for (int joint = 0; joint < kJoints; ++joint) {
        auto& is_fixed = fixed[static_cast<std::size_t>(joint)];
        const bool outwards = (q(joint) <= lower(joint) && step(joint) < 0.0) ||
                              (q(joint) >= upper(joint) && step(joint) > 0.0);
        if (!is_fixed && outwards) is_fixed = again = true;
      }
      if (!again) break;
    }
    const double largest = step.cwiseAbs().maxCoeff();
    if (largest < 1e-7) break;
    if (largest > kMostStep_rad) step *= kMostStep_rad / largest;
    const Joints moved = (q + step).cwiseMax(lower).cwiseMin(upper);
    Errors there = errors_at(chain, offset, goal, moved, options);
    if (there.cost < errors.cost) {
      const bool settled = errors.cost - there.cost < 1e-9 * (1.0 + there.cost);
      q = moved;
      errors = there;
      damping = std::max(1e-6, 0.3 * damping);
      if (settled) break;
    } else {
      damping = std::max(1e-3, 10.0 * damping);
      if (damping > 1e9) break;
    }
  }
  return {q, errors.position_m.norm(), errors.turn_rad.norm(), errors.cost};
}

PalmSolution solve_palm_from(const ArmChain& chain, const SeenOffset& offset, const PalmGoal& goal,
                             const std::vector<Joints>& starts, const SolverOptions& options) {
  PalmSolution best = solve_palm(chain, offset, goal, starts.front(), options);
  for (std::size_t i = 1; i < starts.size(); ++i) {
    PalmSolution other = solve_palm(chain, offset, goal, starts[i], options);
    if (other.cost < best.cost) best = other;
  }
  return best;
}

}  // namespace nido::reach
