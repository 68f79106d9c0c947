#include "nido/reach/motion_planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace nido::reach {
namespace {

// Signed distance of a point from a box along the root's axes, negative inside.
double box_distance_m(const Eigen::Vector3d& p, const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
  const Eigen::Vector3d outside = (min - p).cwiseMax(p - max);
  if (outside.maxCoeff() <= 0.0) return outside.maxCoeff();
  return outside.cwiseMax(0.0).norm();
}

std::string in_words(const Eigen::Vector3d& p_Root_m) {
  return fmt::format("{:.2f} m in front, {:.2f} m to the {}, {:.2f} m {} the waist", -p_Root_m.x(),
                     std::abs(p_Root_m.y()), p_Root_m.y() >= 0.0 ? "right" : "left", std::abs(p_Root_m.z()),
                     p_Root_m.z() >= 0.0 ? "above" : "below");
}

PalmGoal moved(const PalmGoal& goal, const Eigen::Vector3d& by_Root_m) {
  PalmGoal other = goal;
  other.X_RootPalm.translation() += by_Root_m;
  return other;
}

}  // namespace

MotionPlanner::MotionPlanner(ArmChain chain, SeenHandModel seen_hand, std::optional<PostureNetwork> postures,
                             PlannerOptions options)
    : chain_(std::move(chain)),
      seen_hand_(std::move(seen_hand)),
      postures_(std::move(postures)),
      options_(std::move(options)) {
  // fixed spread of starts over the middle of the joints' ranges, little torso
  std::mt19937_64 random(12345);
  std::uniform_real_distribution<double> share(0.15, 0.85);
  for (int i = 0; i < 10; ++i) {
    Joints start;
    for (int joint = 0; joint < kJoints; ++joint) {
      start(joint) = chain_.min()(joint) + share(random) * (chain_.max()(joint) - chain_.min()(joint));
    }
    start.head<kTorsoJoints>() *= 0.15;
    starts_.push_back(start);
  }
}

void MotionPlanner::set_objects(std::vector<SeenObject> objects) {
  objects_ = std::move(objects);
  if (!options_.table_is_seen) return;
  constexpr double kLevel_m = 0.008;
  constexpr double kMostOff_m = 0.12;  // of a table, from the usual one
  std::vector<double> undersides_m;
  for (const SeenObject& object : objects_) {
    const double z_m = object.p_Root_m.z() - 0.5 * object.size_m.z();
    if (object.size_m.z() > 0.0 && std::abs(z_m - PlannerOptions{}.table_max_Root_m.z()) < kMostOff_m)
      undersides_m.push_back(z_m);
  }
  std::sort(undersides_m.begin(), undersides_m.end());
  for (std::size_t i = 1; i < undersides_m.size(); ++i) {
    if (undersides_m[i] - undersides_m[i - 1] > kLevel_m) continue;
    options_.table_max_Root_m.z() = 0.5 * (undersides_m[i] + undersides_m[i - 1]);
    return;
  }
}

Eigen::Vector3d MotionPlanner::offset_m(const Joints& q) const {
  return seen_hand_.correction_Root_m(q) + visual_offset_m_;
}

Eigen::Isometry3d MotionPlanner::X_RootPalmSeen(const Joints& q) const {
  Eigen::Isometry3d X = chain_.X_RootPalm(q);
  X.translation() += offset_m(q);
  return X;
}

SolverOptions MotionPlanner::solver_options(const Joints& rest, double rest_weight) const {
  SolverOptions solver;
  solver.rest = rest;
  solver.rest_weight = rest_weight * options_.rest_weight;
  solver.min = chain_.min().cwiseMax(options_.torso_and_arm_min);
  solver.max = chain_.max().cwiseMin(options_.torso_and_arm_max);
  return solver;
}

// The paper's network says how the arm stands for a hand seen there; what it does not know stays in the
// middle.
Joints MotionPlanner::rest_for(const PalmGoal& goal) const {
  Joints rest = options_.home;
  rest.head<kTorsoJoints>().setZero();
  rest.tail<2>().setZero();
  if (postures_) {
    const Eigen::Vector3d p_Root_m = goal.X_RootPalm * seen_hand_.p_PalmMark_m();
    rest.segment<PostureNetwork::kOutputs>(kTorsoJoints) = postures_->posture_rad(p_Root_m);
  }
  return rest;
}

bool MotionPlanner::meets(const PalmSolution& solution) const {
  return solution.position_error_m <= options_.position_tolerance_m &&
         solution.turn_error_rad <= options_.turn_tolerance_rad;
}

Result<Joints> MotionPlanner::posture_for(const PalmGoal& goal, const Joints& now) const {
  const Joints rest = rest_for(goal);
  std::vector<Joints> starts = {rest, now, options_.home};
  starts.insert(starts.end(), starts_.begin(), starts_.end());
  const SolverOptions solver = solver_options(rest, 1.0);
  const SeenOffset offset = [this](const Joints& q) { return offset_m(q); };
  std::optional<Joints> best;
  double best_cost = std::numeric_limits<double>::infinity();
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const Joints& start : starts) {
    const PalmSolution solution = solve_palm(chain_, offset, goal, start, solver);
    nearest_m = std::min(nearest_m, solution.position_error_m);
    if (!meets(solution)) continue;
    // a posture whose arm is in the table is worth little
    const double in_table_m = std::max(0.0, options_.clearance_m - table_clearance_m(solution.q));
    const double cost = solution.cost + 500.0 * in_table_m;
    if (cost < best_cost) {
      best_cost = cost;
      best = solution.q;
    }
  }
  if (!best) {
    return Error{
        ErrorCode::kFailed,
        fmt::format("the hand cannot get to {} in the wanted posture: the nearest it comes is {:.0f} mm away",
                    in_words(goal.X_RootPalm.translation()), 1000.0 * nearest_m)};
  }
  return *best;
}

Result<ApproachPlan> MotionPlanner::approach(const PalmPosture& posture, const SeenObject& object,
                                             double yaw_rad, const Joints& now) const {
  const SeenOffset offset = [this](const Joints& q) { return offset_m(q); };
  std::optional<ApproachPlan> best;
  double best_cost = std::numeric_limits<double>::infinity();
  Error failure{ErrorCode::kFailed, "no posture is known for it"};
  const double yaw = posture.yaw_period_rad > 0.0 ? std::remainder(yaw_rad, posture.yaw_period_rad) : 0.0;
  for (const double turn : posture.turns_rad) {
    Eigen::Isometry3d X_RootObject = Eigen::Isometry3d::Identity();
    X_RootObject.linear() = Eigen::AngleAxisd(yaw + turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    X_RootObject.translation() = object.p_Root_m;
    if (posture.above_top_m) X_RootObject.translation().z() += 0.5 * object.size_m.z() + *posture.above_top_m;
    ApproachPlan plan;
    plan.turn_rad = turn;
    plan.goal.X_RootPalm = X_RootObject * posture.X_ObjectPalm;
    const Eigen::Vector3d back_Root_m =
        -posture.standoff_m * (X_RootObject.linear() * posture.approach_Object);
    plan.standoff = moved(plan.goal, back_Root_m);
    auto q_goal = posture_for(plan.goal, now);
    if (!q_goal) {
      failure = q_goal.error();
      continue;
    }
    plan.q_goal = *q_goal;
    // backwards from the goal, so that the way in between stays in one branch of the arm's postures
    Joints q = plan.q_goal;
    constexpr int kSteps = 8;
    bool reached = true;
    for (int step = 1; step <= kSteps; ++step) {
      const PalmSolution solution = solve_palm(chain_, offset, moved(plan.goal, back_Root_m * step / kSteps),
                                               q, solver_options(q, 2.0));
      q = solution.q;
      reached = reached && meets(solution);
    }
    if (!reached) {
      failure = {ErrorCode::kFailed, fmt::format("the hand cannot stand off from {} by {:.0f} mm",
                                                 in_words(object.p_Root_m), 1000.0 * posture.standoff_m)};
      continue;
    }
    plan.q_standoff = q;
    const Joints from_rest = options_.rest_weight.cwiseProduct(plan.q_goal - rest_for(plan.goal));
    const double in_table_m = std::max(0.0, -table_clearance_m(plan.q_goal));
    const double cost = from_rest.squaredNorm() + 500.0 * in_table_m +
                        posture.turn_cost * std::abs(turn - posture.turns_rad.front());
    if (cost < best_cost) {
      best_cost = cost;
      best = plan;
    }
  }
  if (!best) {
    return Error{ErrorCode::kFailed,
                 fmt::format("'{}' at {} is out of reach ({:.2f} m from the waist): {}", object.name,
                             in_words(object.p_Root_m), object.p_Root_m.norm(), failure.message)};
  }
  return *best;
}

double MotionPlanner::table_clearance_m(const Joints& q) const {
  double least = std::numeric_limits<double>::infinity();
  for (const ArmChain::BodyPoint& point : chain_.body_points(q)) {
    least =
        std::min(least, box_distance_m(point.p_Root_m, options_.table_min_Root_m, options_.table_max_Root_m) -
                            point.radius_m);
  }
  return least;
}

double MotionPlanner::clearance_m(const Joints& q) const {
  double least = table_clearance_m(q);
  for (const ArmChain::BodyPoint& point : chain_.body_points(q)) {
    for (const SeenObject& object : objects_) {
      const Eigen::Vector3d half = 0.5 * object.size_m;
      least = std::min(least, box_distance_m(point.p_Root_m, object.p_Root_m - half, object.p_Root_m + half) -
                                  point.radius_m);
    }
  }
  return least;
}

double MotionPlanner::way_clearance_m(const JointPath& path) const {
  // near an end less room is no fault when the end itself has less, as long as the way leads out of it
  constexpr double kNear_m = 0.04;
  const Eigen::Vector3d start_m = chain_.X_RootPalm(path.start()).translation();
  const Eigen::Vector3d end_m = chain_.X_RootPalm(path.end()).translation();
  const double at_start_m = clearance_m(path.start()) - 0.002;
  const double at_end_m = clearance_m(path.end()) - 0.002;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < path.points().size(); i += 4) {
    const Joints& q = path.points()[i];
    const Eigen::Vector3d p_m = chain_.X_RootPalm(q).translation();
    double allowed_m = options_.clearance_m;
    if ((p_m - start_m).norm() < kNear_m) allowed_m = std::min(allowed_m, at_start_m);
    if ((p_m - end_m).norm() < kNear_m) allowed_m = std::min(allowed_m, at_end_m);
    least = std::min(least, clearance_m(q) - allowed_m);
  }
  return least;
}

Result<JointPath> MotionPlanner::free_way(const Joints& from, const Joints& to) const {
  const SeenOffset offset = [this](const Joints& q) { return offset_m(q); };
  const auto raised = [&](const Joints& q, double by_m) {
    PalmGoal goal;
    goal.X_RootPalm = X_RootPalmSeen(q);
    goal.X_RootPalm.translation().z() += by_m;
    goal.turn_weight = Eigen::Vector3d(0.3, 0.3, 0.05);
    return solve_palm(chain_, offset, goal, q, solver_options(q, 1.0)).q;
  };
  std::vector<std::vector<Joints>> candidates = {{from, to}};
  for (const double by_m : {0.04, 0.08, 0.12, 0.18}) {
    candidates.push_back({from, raised(to, by_m), to});
    candidates.push_back({from, raised(from, by_m), to});
    candidates.push_back({from, raised(from, by_m), raised(to, by_m), to});
  }
  for (const double by_m : {0.08, 0.15}) {
    candidates.push_back({from, raised(from, by_m), options_.home, raised(to, by_m), to});
  }
  std::optional<JointPath> best;
  double best_clearance_m = -std::numeric_limits<double>::infinity();
  for (const std::vector<Joints>& knots : candidates) {
    JointPath path(knots, options_.speed_rad_s);
    const double clear_m = way_clearance_m(path);
    if (clear_m > best_clearance_m) {
      best_clearance_m = clear_m;
      best = std::move(path);
    }
    if (best_clearance_m >= -1e-9) break;
  }
  constexpr double kGrazing_m = 0.03;  // the things' boxes and the flesh are drawn generously
  if (best_clearance_m < -kGrazing_m) {
    return Error{
        ErrorCode::kFailed,
        fmt::format("no free way for the arm: the best one goes {:.0f} mm into the table or a thing on it",
                    -1000.0 * best_clearance_m)};
  }
  return std::move(*best);
}

Result<JointPath> MotionPlanner::straight_way(const Joints& from, const PalmGoal& goal, double speed_m_s,
                                              double joint_speed_share) const {
  constexpr double kKnotSpacing_m = 0.008;
  constexpr double kKnotSpacing_rad = 0.06;
  const SeenOffset offset = [this](const Joints& q) { return offset_m(q); };
  const Eigen::Isometry3d X_start = X_RootPalmSeen(from);
  const Eigen::Vector3d tool_start = X_start * goal.p_PalmTool_m;
  const Eigen::Vector3d tool_end = goal.X_RootPalm * goal.p_PalmTool_m;
  const Eigen::Quaterniond turn_start(X_start.linear());
  const Eigen::Quaterniond turn_end(goal.X_RootPalm.linear());
  const double length_m = (tool_end - tool_start).norm();
  const double turn_rad = turn_start.angularDistance(turn_end) * goal.turn_weight.maxCoeff();
  const int count = 1 + static_cast<int>(std::max(length_m / kKnotSpacing_m, turn_rad / kKnotSpacing_rad));
  std::vector<Joints> knots = {from};
  for (int i = 1; i <= count; ++i) {
    const double share = static_cast<double>(i) / count;
    PalmGoal knot = goal;
    knot.X_RootPalm.linear() = turn_start.slerp(share, turn_end).toRotationMatrix();
    const Eigen::Vector3d tool = tool_start + share * (tool_end - tool_start);
    knot.X_RootPalm.translation() = tool - knot.X_RootPalm.linear() * goal.p_PalmTool_m;
    const PalmSolution solution =
        solve_palm(chain_, offset, knot, knots.back(), solver_options(knots.back(), 2.0));
    if (!meets(solution)) {
      return Error{
          ErrorCode::kFailed,
          fmt::format("the straight way to {} ends {:.0f} mm before it: the hand is {:.0f} mm and {:.0f} "
                      "degrees off there",
                      in_words(tool_end), 1000.0 * (tool_end - tool).norm(),
                      1000.0 * solution.position_error_m, solution.turn_error_rad * 57.3)};
    }
    knots.push_back(solution.q);
  }
  return JointPath(knots, joint_speed_share * options_.speed_rad_s, 1.875 * length_m / speed_m_s);
}

}  // namespace nido::reach
