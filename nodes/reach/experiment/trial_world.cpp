#include "trial_world.h"

#include <fmt/format.h>

#include <cstdlib>

namespace nido::reach {
namespace {

constexpr const char* kWorldPort = "/icubSim/world";
constexpr double kRadius_m = 0.03;
// The world port's frame, the old simulator's: x left, y up, z forward; this is the root in it.
constexpr double kRootHeight_m = 0.5976;
constexpr double kRootForward_m = -0.026;

}  // namespace

Status TrialWorld::put(const Sphere& sphere, const Eigen::Vector3d& p_Root_m) {
  const std::string place =
      fmt::format("{} {} {}", -p_Root_m.y(), p_Root_m.z() + kRootHeight_m, -p_Root_m.x() + kRootForward_m);
  const bool is_new = made_.insert(sphere.number).second;
  const std::string line = is_new ? fmt::format("world mk ssph {} {} {} {}", kRadius_m, place, sphere.colour,
                                                sphere.touches_robot ? 1 : 0)
                                  : fmt::format("world set ssph {} {}", sphere.number, place);
  auto answer = node_.call(kWorldPort, line, 10.0);
  if (!answer) return answer.error();
  if (answer->find("fail") != std::string::npos) {
    return Error{ErrorCode::kFailed, fmt::format("the world answered '{}' to '{}'", *answer, line)};
  }
  if (!is_new) return {};
  const auto pose = numbers(fmt::format("world where \"ssph {}\"", sphere.number), 10);
  if (!pose) return pose.error();
  const Eigen::Vector3d there((*pose)[0], (*pose)[1], (*pose)[2]);
  if ((there - p_Root_m).norm() > 1e-3) {
    return Error{ErrorCode::kFailed, fmt::format("the sphere is {:.1f} mm from where it was put",
                                                 1000.0 * (there - p_Root_m).norm())};
  }
  return {};
}

Result<Eigen::Isometry3d> TrialWorld::X_RootPalm(const std::string& side) {
  const auto pose = numbers("world palm " + side, 7);
  if (!pose) return pose.error();
  const std::vector<double>& values = *pose;
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::Quaterniond(values[6], values[3], values[4], values[5]).normalized().toRotationMatrix();
  X.translation() << values[0], values[1], values[2];
  return X;
}

Result<Eigen::Vector3d> TrialWorld::mark_Root_m(const std::string& side,
                                                const Eigen::Vector3d& p_PalmMark_m) {
  const auto palm = X_RootPalm(side);
  if (!palm) return palm.error();
  return Eigen::Vector3d(*palm * p_PalmMark_m);
}

Result<std::vector<double>> TrialWorld::numbers(const std::string& line, std::size_t count) {
  auto answer = node_.call(kWorldPort, line, 10.0);
  if (!answer) return answer.error();
  std::vector<double> values;
  for (const char* at = answer->c_str();;) {
    char* end = nullptr;
    const double value = std::strtod(at, &end);
    if (end == at) break;
    values.push_back(value);
    at = end;
  }
  if (values.size() != count) {
    return Error{ErrorCode::kFailed, fmt::format("the world answered '{}' to '{}'", *answer, line)};
  }
  return values;
}

}  // namespace nido::reach
