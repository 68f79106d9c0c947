#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <vector>

#include "nido/reach/arm_chain.h"

namespace nido::reach {

// Where the hand shall be.
struct PalmGoal {
  Eigen::Isometry3d X_RootPalm = Eigen::Isometry3d::Identity();  // as the eyes would see it
  // Point of the palm frame whose position counts; it shall come to X_RootPalm * p_PalmTool_m. Zero: the
  // palm's origin.
  Eigen::Vector3d p_PalmTool_m = Eigen::Vector3d::Zero();
  // How much a turn about root x, y, z counts: (1, 1, 1) the whole orientation, (1, 1, 0.1) all but the turn
  // about the vertical, zero for position alone.
  Eigen::Vector3d turn_weight = Eigen::Vector3d::Ones();
};

// Seen minus real position of the hand for a posture, root frame, m: learned correction and what the eyes say
// now.
using SeenOffset = std::function<Eigen::Vector3d(const Joints&)>;

struct PalmSolution {
  Joints q = Joints::Zero();
  double position_error_m = 0.0;
  double turn_error_rad = 0.0;  // weighted by turn_weight
  double cost = 0.0;
};

struct SolverOptions {
  Joints rest = Joints::Zero();  // posture to stay near where the goal leaves freedom
  Joints rest_weight =
      Joints::Constant(0.2);  // 1/rad: cost of one rad from rest, against 2 mm or 0.02 rad off the goal
  Joints min = Joints::Constant(-10.0);  // narrower limits than the body's own, where wanted
  Joints max = Joints::Constant(10.0);
  double limit_margin_rad = 0.02;  // stay so far inside the joint limits
  int iterations = 80;
};

// Damped least squares within joint limits, from one start posture (method: docs/reach.md). Always gives a
// posture within the limits; how far it is from the goal is in the solution.
PalmSolution solve_palm(const ArmChain& chain, const SeenOffset& offset, const PalmGoal& goal,
                        const Joints& start, const SolverOptions& options);

// The cheapest solution of several starts (at least one).
PalmSolution solve_palm_from(const ArmChain& chain, const SeenOffset& offset, const PalmGoal& goal,
                             const std::vector<Joints>& starts, const SolverOptions& options);

}  // namespace nido::reach
