#include "nido/kinematics/robot_model.h"

#include <cmath>
#include <cstdlib>
#include <iostream>

namespace nido {
namespace {

void check(bool fine, const std::string& sentence) {
  if (!fine) {
    std::cerr << "bug: " << sentence << '\n';
    std::abort();
  }
}

// Number of letters by which two names differ, roughly: what they do not share at both ends.
std::size_t distance_of_names(std::string_view a, std::string_view b) {
  std::size_t front = 0;
  while (front < a.size() && front < b.size() && a[front] == b[front]) ++front;
  std::size_t back = 0;
  while (back < a.size() - front && back < b.size() - front &&
         a[a.size() - 1 - back] == b[b.size() - 1 - back])
    ++back;
  return std::max(a.size(), b.size()) - front - back;
}

template <class List, class NameOf>
Result<int> find_by_name(const List& list, std::string_view wanted, const char* kind,
                         const std::string& robot, NameOf name_of) {
  std::size_t best = std::string::npos;
  std::string nearest;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string& name = name_of(list[i]);
    if (name == wanted) return static_cast<int>(i);
    const std::size_t distance = distance_of_names(name, wanted);
    if (distance < best) {
      best = distance;
      nearest = name;
    }
  }
  std::string sentence = "robot \"" + robot + "\" has no " + kind + " \"" + std::string(wanted) + "\"";
  if (!nearest.empty()) sentence += "; the nearest name is \"" + nearest + "\"";
  return Error{ErrorCode::kNotFound, sentence};
}

}  // namespace

const Axis& RobotModel::axis(int index) const {
  check(index >= 0 && index < axis_count(), "axis index " + std::to_string(index) + " is out of range");
  const auto& [part, number] = axis_refs_[index];
  return parts_[part].axes[number];
}

Result<int> RobotModel::link_index(std::string_view link) const {
  return find_by_name(links_, link, "link", name_,
                      [](const BodyLink& l) -> const std::string& { return l.name; });
}
Result<int> RobotModel::hinge_index(std::string_view hinge) const {
  return find_by_name(hinges_, hinge, "revolute joint", name_,
                      [](const Hinge& h) -> const std::string& { return h.name; });
}
Result<int> RobotModel::part_index(std::string_view part) const {
  return find_by_name(parts_, part, "part", name_,
                      [](const Part& p) -> const std::string& { return p.name; });
}
Result<int> RobotModel::axis_index(std::string_view axis_name) const {
  return find_by_name(axis_refs_, axis_name, "axis", name_,
                      [this](const std::pair<int, int>& r) -> const std::string& {
                        return parts_[r.first].axes[r.second].name;
                      });
}

Result<HandInfo> RobotModel::hand(std::string_view side) const {
  const auto found = find_by_name(hands_, side, "hand", name_,
                                  [](const HandInfo& h) -> const std::string& { return h.side; });
  if (!found) return found.error();
  return hands_[*found];
}

Result<int> RobotModel::camera_link(std::string_view side) const {
  const auto found = camera_links_.find(side);
  if (found == camera_links_.end()) {
    return Error{ErrorCode::kNotFound,
                 "robot \"" + name_ + "\" has no camera \"" + std::string(side) + "\" in its <nido> block"};
  }
  return found->second;
}

Eigen::VectorXd RobotModel::home_axes() const {
  Eigen::VectorXd axes(axis_count());
  for (int i = 0; i < axis_count(); ++i) axes[i] = axis(i).home_rad;
  return clamped(axes);
}

Eigen::VectorXd RobotModel::clamped(const Eigen::VectorXd& axes_rad) const {
  check(axes_rad.size() == axis_count(), "a vector of all axes has the wrong size");
  Eigen::VectorXd result = axes_rad;
  for (int i = 0; i < axis_count(); ++i)
    result[i] = std::min(std::max(result[i], axis(i).lower_rad), axis(i).upper_rad);
  return result;
}

Result<Eigen::VectorXd> RobotModel::axes_from_parts(
    const std::map<std::string, std::vector<double>>& parts_rad) const {
  Eigen::VectorXd axes = zero_axes();
  for (const auto& [part_name, values] : parts_rad) {
    const auto index = part_index(part_name);
    if (!index) return index.error();
    const Part& part = parts_[*index];
    if (values.size() != part.axes.size()) {
      return Error{ErrorCode::kInvalidArgument, "part \"" + part_name + "\" has " +
                                                    std::to_string(part.axes.size()) + " axes, but " +
                                                    std::to_string(values.size()) + " values were given"};
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!std::isfinite(values[i])) {
        return Error{ErrorCode::kInvalidArgument,
                     "the value of axis \"" + part.axes[i].name + "\" is not a finite number"};
      }
      axes[part.first_axis + static_cast<int>(i)] = values[i];
    }
  }
  return axes;
}

Result<Eigen::VectorXd> RobotModel::axes_from_names(const std::map<std::string, double>& axes_rad) const {
  Eigen::VectorXd axes = zero_axes();
  for (const auto& [axis_name, value] : axes_rad) {
    const auto index = axis_index(axis_name);
    if (!index) return index.error();
    if (!std::isfinite(value)) {
      return Error{ErrorCode::kInvalidArgument,
                   "the value of axis \"" + axis_name + "\" is not a finite number"};
    }
    axes[*index] = value;
  }
  return axes;
}

double RobotModel::hinge_angle(int hinge, const Eigen::VectorXd& axes_rad) const {
  double angle = hinge_offsets_rad_[hinge];
  for (const AxisShare& share : hinge_shares_[hinge]) angle += share.multiplier * axes_rad[share.axis];
  return angle;
}

Eigen::VectorXd RobotModel::hinge_angles(const Eigen::VectorXd& axes_rad) const {
  check(axes_rad.size() == axis_count(), "a vector of all axes has the wrong size");
  Eigen::VectorXd angles(static_cast<Eigen::Index>(hinges_.size()));
  for (std::size_t h = 0; h < hinges_.size(); ++h)
    angles[static_cast<Eigen::Index>(h)] = hinge_angle(static_cast<int>(h), axes_rad);
  return angles;
}

Eigen::VectorXd RobotModel::axes_from_hinges(const Eigen::VectorXd& hinges_rad) const {
  check(hinges_rad.size() == static_cast<Eigen::Index>(hinges_.size()),
        "a vector of all hinges has the wrong size");
  Eigen::VectorXd turned = hinges_rad;
  for (std::size_t h = 0; h < hinges_.size(); ++h)
    turned[static_cast<Eigen::Index>(h)] -= hinge_offsets_rad_[h];
  return axes_from_hinges_ * turned;
}

Eigen::Isometry3d RobotModel::X_RootLink(int link, const Eigen::VectorXd& axes_rad) const {
  check(link >= 0 && link < static_cast<int>(links_.size()),
        "link index " + std::to_string(link) + " is out of range");
  check(axes_rad.size() == axis_count(), "a vector of all axes has the wrong size");
  Eigen::Isometry3d X_LinkTip = Eigen::Isometry3d::Identity();
  for (int i = link; links_[i].parent >= 0; i = links_[i].parent) {
    if (links_[i].hinge >= 0) {
      X_LinkTip =
          Eigen::AngleAxisd(hinge_angle(links_[i].hinge, axes_rad), Eigen::Vector3d::UnitZ()) * X_LinkTip;
    }
    X_LinkTip = links_[i].X_ParentChild0 * X_LinkTip;
  }
  return X_LinkTip;
}

std::vector<Eigen::Isometry3d> RobotModel::X_RootLinks(const Eigen::VectorXd& hinges_rad) const {
  check(hinges_rad.size() == static_cast<Eigen::Index>(hinges_.size()),
        "a vector of all hinges has the wrong size");
  std::vector<Eigen::Isometry3d> poses(links_.size(), Eigen::Isometry3d::Identity());
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const BodyLink& link = links_[i];
    if (link.parent < 0) continue;
    poses[i] = poses[link.parent] * link.X_ParentChild0;
    if (link.hinge >= 0) poses[i].rotate(Eigen::AngleAxisd(hinges_rad[link.hinge], Eigen::Vector3d::UnitZ()));
  }
  return poses;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> RobotModel::jacobian(int link, const Eigen::VectorXd& axes_rad,
                                                              const std::vector<int>& axes_of_interest,
                                                              const Eigen::Vector3d& p_LinkPoint_m) const {
  const Eigen::Vector3d p_RootPoint = X_RootLink(link, axes_rad) * p_LinkPoint_m;
  Eigen::Matrix<double, 6, Eigen::Dynamic> result =
      Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, static_cast<Eigen::Index>(axes_of_interest.size()));
  for (int i = link; links_[i].parent >= 0; i = links_[i].parent) {
    const int hinge = links_[i].hinge;
    if (hinge < 0) continue;
    const Eigen::Isometry3d X_RootHinge = X_RootLink(i, axes_rad);
    const Eigen::Vector3d z = X_RootHinge.linear().col(2);
    Eigen::Matrix<double, 6, 1> twist;
    twist << z.cross(p_RootPoint - X_RootHinge.translation()), z;
    for (const AxisShare& share : hinge_shares_[hinge]) {
      for (std::size_t k = 0; k < axes_of_interest.size(); ++k) {
        if (axes_of_interest[k] == share.axis)
          result.col(static_cast<Eigen::Index>(k)) += share.multiplier * twist;
      }
    }
  }
  return result;
}

double RobotModel::mass_kg() const {
  double sum = 0;
  for (const BodyLink& link : links_) sum += link.mass_kg;
  return sum;
}

Eigen::Vector3d RobotModel::p_RootCom_m(const Eigen::VectorXd& axes_rad) const {
  const auto poses = X_RootLinks(hinge_angles(axes_rad));
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < links_.size(); ++i)
    sum += links_[i].mass_kg * (poses[i] * links_[i].p_LinkCom_m);
  return sum / mass_kg();
}

}  // namespace nido
