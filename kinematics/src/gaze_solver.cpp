#include "nido/kinematics/gaze_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace nido {
namespace {

constexpr int kJoints = 6;
constexpr double kMargin_rad = 0.005;
constexpr double kMostStep_rad = 0.4;
constexpr double kFar_m = 10;
// pixels that one rad away from where a joint would rather be costs: the eyes straight ahead, the neck's roll
// upright, its pitch and yaw where they are
constexpr std::array<double, kJoints> kRest_px = {0.2, 4, 0.2, 3, 3, 0};

}  // namespace

Result<GazeSolver> GazeSolver::create(const RobotModel& model, const PinholeCamera& camera) {
  GazeSolver solver(model, camera);
  for (const auto& [part, axes, first] :
       {std::tuple{"head", 6, &solver.head_first_}, std::tuple{"torso", 3, &solver.torso_first_}}) {
    const Result<int> index = model.part_index(part);
    if (!index) return index.error();
    const Part& found = model.parts()[static_cast<std::size_t>(*index)];
    if (static_cast<int>(found.axes.size()) != axes) {
      return Error{ErrorCode::kInvalidArgument, std::string("part ") + part + " has " +
                                                    std::to_string(found.axes.size()) + " joints, not " +
                                                    std::to_string(axes)};
    }
    *first = found.first_axis;
  }
  for (const int eye : {0, 1}) {
    const Result<int> link = model.camera_link(eye == 0 ? "left" : "right");
    if (!link) return link.error();
    solver.cameras_[static_cast<std::size_t>(eye)] = *link;
  }
  for (int j = 0; j < kJoints; ++j) {
    solver.range_.lower_rad[j] = model.axis(solver.head_first_ + j).lower_rad;
    solver.range_.upper_rad[j] = model.axis(solver.head_first_ + j).upper_rad;
  }
  return solver;
}

Eigen::VectorXd GazeSolver::axes(const TorsoAngles& torso_rad, const HeadAngles& head_rad) const {
  Eigen::VectorXd all = model_->zero_axes();
  all.segment<6>(head_first_) = head_rad;
  all.segment<3>(torso_first_) = torso_rad;
  return all;
}

Eigen::Vector4d GazeSolver::seen_px(const Eigen::Vector3d& p_Root_m, const Eigen::VectorXd& axes) const {
  Eigen::Vector4d seen;
  for (const int eye : {0, 1}) {
    const Eigen::Vector3d p =
        model_->X_RootLink(cameras_[static_cast<std::size_t>(eye)], axes).inverse() * p_Root_m;
    // all the way round, so that what is behind has a way back
    seen[2 * eye] = camera_.fx_px * std::atan2(p.x(), p.z());
    seen[2 * eye + 1] = camera_.fy_px * std::atan2(p.y(), std::hypot(p.x(), p.z()));
  }
  return seen;
}

double GazeSolver::error_px(const Eigen::Vector3d& p_Root_m, const TorsoAngles& torso_rad,
                            const HeadAngles& head_rad) const {
  const Eigen::Vector4d seen = seen_px(p_Root_m, axes(torso_rad, head_rad));
  return std::max(seen.head<2>().norm(), seen.tail<2>().norm());
}

GazeSolution GazeSolver::solve(const Eigen::Vector3d& p_Root_m, const TorsoAngles& torso_rad,
                               const HeadAngles& start_rad, const HeadRange& range) const {
  const HeadAngles middle = (range.lower_rad + range.upper_rad) / 2;
  const HeadAngles lower = (range.lower_rad.array() + kMargin_rad).min(middle.array());
  const HeadAngles upper = (range.upper_rad.array() - kMargin_rad).max(middle.array());
  HeadAngles rest = start_rad.cwiseMax(lower).cwiseMin(upper);
  rest[1] = std::clamp(0.0, lower[1], upper[1]);
  rest[3] = std::clamp(0.0, lower[3], upper[3]);
  rest[4] = std::clamp(0.0, lower[4], upper[4]);
  HeadAngles weight;
  for (int j = 0; j < kJoints; ++j) weight[j] = kRest_px[static_cast<std::size_t>(j)];
  HeadAngles q = start_rad.cwiseMax(lower).cwiseMin(upper);
  double damping = 1.0;
  const auto cost_at = [&](const HeadAngles& at, const Eigen::Vector4d& seen) {
    return seen.squaredNorm() + weight.cwiseProduct(rest - at).squaredNorm();
  };
  Eigen::Vector4d seen = seen_px(p_Root_m, axes(torso_rad, q));
  double cost = cost_at(q, seen);
  for (int iteration = 0; iteration < 60; ++iteration) {
    Eigen::Matrix<double, 4, kJoints> slope;
    for (int j = 0; j < kJoints; ++j) {
      constexpr double kStep_rad = 1e-5;
      HeadAngles moved = q;
      moved[j] += kStep_rad;
      slope.col(j) = (seen_px(p_Root_m, axes(torso_rad, moved)) - seen) / kStep_rad;
    }
    const HeadAngles stiffness = weight.cwiseAbs2();
    const HeadAngles downhill = -slope.transpose() * seen + stiffness.cwiseProduct(rest - q);
    Eigen::Matrix<double, kJoints, kJoints> matrix = slope.transpose() * slope;
    matrix.diagonal() += stiffness;
    matrix.diagonal().array() += damping;
    std::array<bool, kJoints> fixed{};
    HeadAngles step;
    for (int pass = 0; pass < kJoints; ++pass) {
      auto reduced = matrix;
      HeadAngles force = downhill;
      for (int j = 0; j < kJoints; ++j) {
        if (!fixed[static_cast<std::size_t>(j)]) continue;
        reduced.row(j).setZero();
        reduced.col(j).setZero();
        reduced(j, j) = 1;
        force[j] = 0;
      }
      step = reduced.ldlt().solve(force);
      bool again = false;
      for (int j = 0; j < kJoints; ++j) {
        bool& is_fixed = fixed[static_cast<std::size_t>(j)];
        if (!is_fixed && ((q[j] <= lower[j] && step[j] < 0) || (q[j] >= upper[j] && step[j] > 0))) {
          is_fixed = again = true;
        }
      }
      if (!again) break;
    }
    const double largest = step.cwiseAbs().maxCoeff();
    if (!(largest > 1e-6)) break;
    if (largest > kMostStep_rad) step *= kMostStep_rad / largest;
    const HeadAngles moved = (q + step).cwiseMax(lower).cwiseMin(upper);
    const Eigen::Vector4d seen_there = seen_px(p_Root_m, axes(torso_rad, moved));
    const double cost_there = cost_at(moved, seen_there);
    if (cost_there < cost) {
      const bool settled = cost - cost_there < 1e-6 * (1 + cost_there);
      q = moved;
      seen = seen_there;
      cost = cost_there;
      damping = std::max(1e-3, 0.2 * damping);
      if (settled) break;
    } else {
      damping = std::max(1.0, 8 * damping);
      if (damping > 1e12) break;
    }
  }
  return {q, std::max(seen.head<2>().norm(), seen.tail<2>().norm()),
          (seen.head<2>() + seen.tail<2>()).norm() / 2};
}

Eigen::Vector3d GazeSolver::p_RootFixation_m(const TorsoAngles& torso_rad, const HeadAngles& head_rad) const {
  const Eigen::VectorXd all = axes(torso_rad, head_rad);
  std::array<Ray, 2> rays;
  for (const int eye : {0, 1}) {
    const Eigen::Isometry3d X = model_->X_RootLink(cameras_[static_cast<std::size_t>(eye)], all);
    rays[static_cast<std::size_t>(eye)] = {X.translation(), X.linear().col(2)};
  }
  const Eigen::Vector3d far =
      (rays[0].origin_m + rays[1].origin_m) / 2 + kFar_m * (rays[0].direction + rays[1].direction) / 2;
  const std::optional<Triangulation> met = triangulate(rays[0], rays[1]);
  return met && met->distance_left_m < kFar_m ? met->p_m : far;
}

}  // namespace nido
