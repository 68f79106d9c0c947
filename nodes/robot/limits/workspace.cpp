#include "limits/workspace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace nido {
namespace {

// links come to rest this far before a border
constexpr double kMargin_m = 0.005;
// a link may at most cover the rest of the way in this time
constexpr double kBrakingTime_s = 0.1;
// joints that were told to stop have stopped after this time
constexpr double kStoppingTime_s = 0.1;
// nearer than this no force is put on the joints: what it would do is not known
constexpr double kNear_m = 0.05;
// a joint that moves no faster stands
constexpr double kStanding_rad_s = 0.01;
// deeper by no more than this is not deeper: rounding
constexpr double kRounding_m = 1e-6;

double signed_distance(const WorkspaceRule& rule, const Eigen::Vector3d& p_Root_m) {
  switch (rule.kind) {
    case WorkspaceRule::Kind::kInside:
      return std::min((p_Root_m - rule.box_Root_m.min()).minCoeff(),
                      (rule.box_Root_m.max() - p_Root_m).minCoeff()) -
             rule.radius_m;
    case WorkspaceRule::Kind::kOutside: {
      const Eigen::Vector3d beyond_m =
          (rule.box_Root_m.min() - p_Root_m).cwiseMax(p_Root_m - rule.box_Root_m.max());
      const double outside_m = beyond_m.cwiseMax(0.0).norm();
      return (outside_m > 0 ? outside_m : beyond_m.maxCoeff()) - rule.radius_m;
    }
    case WorkspaceRule::Kind::kPlane:
      return rule.normal_Root.dot(p_Root_m - rule.p_RootPlane_m) - rule.radius_m;
  }
  return 0;
}

std::size_t at(int index) { return static_cast<std::size_t>(index); }

Status check(const WorkspaceRule& rule) {
  const auto wrong = [&](const std::string& what) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("workspace '{}': {}", rule.name, what)};
  };
  if (rule.links.empty()) return wrong("it names no links");
  if (!std::isfinite(rule.radius_m) || rule.radius_m < 0) return wrong("its radius is no length");
  if (rule.kind == WorkspaceRule::Kind::kPlane) {
    if (!rule.p_RootPlane_m.allFinite() || std::abs(rule.normal_Root.norm() - 1) > 1e-6)
      return wrong("its normal has no direction");
  } else if (!((rule.box_Root_m.max() - rule.box_Root_m.min()).minCoeff() > 0)) {
    return wrong("its box is empty: each axis goes from a smaller to a greater number");
  }
  return {};
}

}  // namespace

Result<std::shared_ptr<Workspace>> Workspace::create(RobotModel model, std::vector<WorkspaceRule> rules) {
  for (const WorkspaceRule& rule : rules) {
    if (Status valid = check(rule); !valid) return valid.error();
    for (const std::string& link : rule.links) {
      if (const Result<int> found = model.link_index(link); !found) {
        return Error{found.error().code, fmt::format("workspace '{}': {}", rule.name, found.error().message)};
      }
    }
  }
  return std::shared_ptr<Workspace>(new Workspace(std::move(model), std::move(rules)));
}

Workspace::Workspace(RobotModel model, std::vector<WorkspaceRule> rules)
    : model_(std::move(model)),
      rules_(std::move(rules)),
      now_rad_(model_.home_axes()),
      goal_rad_(model_.home_axes()) {
  for (std::size_t r = 0; r < rules_.size(); ++r) {
    for (const std::string& name : rules_[r].links) {
      Guard guard{r, *model_.link_index(name), std::vector<bool>(at(model_.axis_count()), false)};
      std::vector<bool> carries(model_.hinges().size(), false);
      for (int link = guard.link; link >= 0; link = model_.links()[at(link)].parent) {
        if (const int hinge = model_.links()[at(link)].hinge; hinge >= 0) carries[at(hinge)] = true;
      }
      for (int axis = 0; axis < model_.axis_count(); ++axis) {
        const std::vector<HingeShare>& shares = model_.axis(axis).hinges;
        guard.moved_by[at(axis)] = std::any_of(
            shares.begin(), shares.end(), [&](const HingeShare& share) { return carries[at(share.hinge)]; });
      }
      guards_.push_back(std::move(guard));
    }
  }
}

std::vector<int> Workspace::axes_of(const IControlBoard& board) const {
  std::vector<int> axes;
  for (int joint = 0; joint < board.axes(); ++joint) {
    const Result<std::string> name = board.axis_name(joint);
    const Result<int> axis = name ? model_.axis_index(*name) : Result<int>(name.error());
    axes.push_back(axis ? *axis : -1);
  }
  return axes;
}

double Workspace::distance_m(const Guard& guard, const Eigen::VectorXd& axes_rad) const {
  return signed_distance(rules_[guard.rule], model_.X_RootLink(guard.link, axes_rad).translation());
}

bool Workspace::is_moved(const Guard& guard, int axis) { return axis >= 0 && guard.moved_by[at(axis)]; }

bool Workspace::is_moved(const Guard& guard, std::span<const int> axes) {
  return std::any_of(axes.begin(), axes.end(), [&](int axis) { return is_moved(guard, axis); });
}

void Workspace::note(std::span<const int> axes, std::span<const double> position_rad,
                     std::span<const std::optional<double>> target_rad) {
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (axes[i] < 0) continue;
    now_rad_[axes[i]] = position_rad[i];
    goal_rad_[axes[i]] = target_rad[i].value_or(position_rad[i]);
  }
}

Status Workspace::check_targets(std::span<const int> axes, std::span<const double> target_rad) const {
  const std::lock_guard lock(mutex_);
  Eigen::VectorXd wanted_rad = goal_rad_;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (axes[i] >= 0) wanted_rad[axes[i]] = target_rad[i];
  }
  for (const Guard& guard : guards_) {
    if (!is_moved(guard, axes)) continue;
    const double there_m = distance_m(guard, wanted_rad);
    if (there_m >= 0 || there_m >= distance_m(guard, now_rad_) - kRounding_m) continue;
    const WorkspaceRule& rule = rules_[guard.rule];
    return Error{ErrorCode::kFailed,
                 fmt::format("{} would come {:.0f} mm beyond the border '{}' of the workspace: nothing moves",
                             model_.links()[at(guard.link)].name, -there_m * 1e3, rule.name)};
  }
  return {};
}

std::optional<std::string> Workspace::brake(std::span<const int> axes, std::span<const double> from_rad,
                                            std::span<double> step_rad, double dt_s) const {
  const std::lock_guard lock(mutex_);
  std::optional<std::string> braked;
  Eigen::VectorXd here_rad = now_rad_;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (axes[i] >= 0) here_rad[axes[i]] = from_rad[i];
  }
  for (const Guard& guard : guards_) {
    if (!is_moved(guard, axes)) continue;
    Eigen::VectorXd next_rad = here_rad;
    for (std::size_t i = 0; i < axes.size(); ++i) {
      if (is_moved(guard, axes[i])) next_rad[axes[i]] += step_rad[i];
    }
    const double here_m = distance_m(guard, here_rad) - kMargin_m;
    const double towards_m = here_m - (distance_m(guard, next_rad) - kMargin_m);
    const double allowed_m = std::max(here_m, 0.0) * std::min(dt_s / kBrakingTime_s, 1.0);
    if (towards_m <= allowed_m + kRounding_m * dt_s) continue;
    const double share = allowed_m / towards_m;
    for (std::size_t i = 0; i < axes.size(); ++i) {
      if (is_moved(guard, axes[i])) step_rad[i] *= share;
    }
    braked = rules_[guard.rule].name;
  }
  return braked;
}

std::vector<int> Workspace::to_stop(std::span<const int> axes, std::span<const double> position_rad,
                                    std::span<const double> velocity_rad_s, std::string& rule) const {
  const std::lock_guard lock(mutex_);
  std::vector<int> stopped;
  Eigen::VectorXd here_rad = now_rad_;
  Eigen::VectorXd ahead_rad = now_rad_;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (axes[i] < 0) continue;
    here_rad[axes[i]] = position_rad[i];
    ahead_rad[axes[i]] = position_rad[i] + velocity_rad_s[i] * kStoppingTime_s;
  }
  for (const Guard& guard : guards_) {
    if (!is_moved(guard, axes)) continue;
    const double ahead_m = distance_m(guard, ahead_rad);
    if (ahead_m >= kMargin_m || ahead_m >= distance_m(guard, here_rad)) continue;
    for (std::size_t i = 0; i < axes.size(); ++i) {
      const bool moves = is_moved(guard, axes[i]) && std::abs(velocity_rad_s[i]) > kStanding_rad_s;
      const int index = static_cast<int>(i);
      if (moves && std::find(stopped.begin(), stopped.end(), index) == stopped.end()) {
        stopped.push_back(index);
        rule = rules_[guard.rule].name;
      }
    }
  }
  return stopped;
}

std::vector<int> Workspace::near_a_border(std::span<const int> axes, std::string& rule) const {
  const std::lock_guard lock(mutex_);
  std::vector<int> near;
  for (const Guard& guard : guards_) {
    if (!is_moved(guard, axes) || distance_m(guard, now_rad_) >= kNear_m) continue;
    rule = rules_[guard.rule].name;
    for (std::size_t i = 0; i < axes.size(); ++i) {
      const int index = static_cast<int>(i);
      if (is_moved(guard, axes[i]) && std::find(near.begin(), near.end(), index) == near.end())
        near.push_back(index);
    }
  }
  return near;
}

}  // namespace nido
