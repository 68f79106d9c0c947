#include "nido/judge/world_truth.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

namespace nido {

namespace {

Eigen::Isometry3d pose_of(const std::vector<double>& numbers) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
  const Eigen::Quaterniond turn(numbers[6], numbers[3], numbers[4], numbers[5]);
  if (turn.norm() > 1e-6) pose.linear() = turn.normalized().toRotationMatrix();
  return pose;
}

}  // namespace

Result<std::vector<double>> WorldTruth::numbers(const std::string& line, std::size_t count) {
  const auto answer = ask_(line);
  if (!answer) return answer.error();
  std::vector<double> values;
  for (const char* place = answer->c_str();;) {
    char* end = nullptr;
    const double value = std::strtod(place, &end);
    if (end == place || !std::isfinite(value)) break;
    values.push_back(value);
    place = end;
  }
  if (values.size() != count) {
    return Error{ErrorCode::kFailed, fmt::format("the world answered '{}' to '{}'; {} numbers were expected",
                                                 *answer, line, count)};
  }
  return values;
}

Result<ObjectTruth> WorldTruth::object(const std::string& name) {
  const auto values = numbers(fmt::format("world where \"{}\"", name), 10);
  if (!values) return values.error();
  return ObjectTruth{pose_of(*values), Eigen::Vector3d((*values)[7], (*values)[8], (*values)[9])};
}

Result<bool> WorldTruth::held(const std::string& name) {
  const auto values = numbers(fmt::format("world touching \"{}\"", name), 2);
  if (!values) return values.error();
  const bool by_hand = (*values)[0] != 0.0;
  const bool by_world = (*values)[1] != 0.0;
  return by_hand && !by_world;
}

Result<bool> WorldTruth::inside(const std::string& object, const std::string& basket) {
  const auto values = numbers(fmt::format("world inside \"{}\" \"{}\"", object, basket), 1);
  if (!values) return values.error();
  return values->front() != 0.0;
}

Result<std::vector<Eigen::Isometry3d>> WorldTruth::X_RootPalms() {
  std::vector<Eigen::Isometry3d> palms;
  for (const char* const side : {"right", "left"}) {
    if (hand_ != "nearer" && hand_ != side) continue;
    const auto values = numbers(fmt::format("world palm {}", side), 7);
    if (!values) return values.error();
    palms.push_back(pose_of(*values));
  }
  return palms;
}

}  // namespace nido
