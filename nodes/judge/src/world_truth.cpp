#include "nido/judge/world_truth.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

namespace nido {

namespace {

Eigen::Isometry3d pose_of(const std::vector<double>& numbers) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
  const Eigen::Quaterniond turn(numbers[3], numbers[4], numbers[5], numbers[6]);
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
  const auto pose = numbers(fmt::format("world truth pose \"{}\"", name), 7);
  if (!pose) return pose.error();
  const auto size = numbers(fmt::format("world truth size \"{}\"", name), 3);
  if (!size) return size.error();
  ObjectTruth truth{pose_of(*pose), Eigen::Vector3d((*size)[0], (*size)[1], (*size)[2])};
  // a bear's frame is between its feet, all others have theirs in the middle
  if (name.ends_with("bear")) truth.X_RootObject.translate(Eigen::Vector3d(0, 0, 0.5 * truth.size_m.z()));
  return truth;
}

Result<bool> WorldTruth::held(const std::string& name) {
  const auto answer = numbers(fmt::format("world truth held \"{}\"", name), 1);
  if (!answer) return answer.error();
  return answer->front() != 0.0;
}

Result<bool> WorldTruth::inside(const std::string& object, const std::string& basket) {
  const auto answer = numbers(fmt::format("world truth inside \"{}\" \"{}\"", object, basket), 1);
  if (!answer) return answer.error();
  return answer->front() != 0.0;
}

Result<Eigen::Isometry3d> WorldTruth::X_RootPalm() {
  const auto values = numbers(fmt::format("world truth hand {}", hand_), 7);
  if (!values) return values.error();
  return pose_of(*values);
}

}  // namespace nido
