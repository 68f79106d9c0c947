#include "nido/grasp/settings.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>

#include "nido/kinematics/robot_model.h"

namespace nido::grasp {

namespace {

constexpr std::size_t kHandJoints = kFingerCount + 1;  // spread joint and the eight fingers joints
constexpr double kRadPerDeg = M_PI / 180.0;

// nine angles of a pre-shape, joints 7..15 of the arm, checked against the limits
Result<FingerPosture> read_preshape(const YAML::Node& node, const std::string& where,
                                    const FingerLimits& limits) {
  const auto place = [&](const YAML::Node& at) {
    return where + ", line " + std::to_string(at.Mark().line + 1);
  };
  if (!node || !node.IsSequence() || node.size() != kHandJoints) {
    return Error{
        ErrorCode::kInvalidArgument,
        place(node) + ": preshape_deg must be a list of 9 angles in degrees, joints 7 to 15 of the arm"};
  }
  FingerPosture posture;
  for (std::size_t i = 0; i < kHandJoints; ++i) {
    double value_rad = NAN;
    try {
      value_rad = node[i].as<double>() * kRadPerDeg;
    } catch (const YAML::Exception&) {
      return Error{ErrorCode::kInvalidArgument, place(node[i]) + ": expected a number of degrees"};
    }
    const double lower = i == 0 ? limits.spread_lower_rad : limits.lower_rad[i - 1];
    const double upper = i == 0 ? limits.spread_upper_rad : limits.upper_rad[i - 1];
    if (!(value_rad >= lower - 1e-6 && value_rad <= upper + 1e-6)) {
      return Error{ErrorCode::kInvalidArgument,
                   place(node[i]) + ": joint " + std::to_string(i + 7) + " cannot go to " +
                       node[i].as<std::string>() + " degrees; its range is " +
                       std::to_string(lower / kRadPerDeg) + " to " + std::to_string(upper / kRadPerDeg)};
    }
    (i == 0 ? posture.spread_rad : posture.joint_rad[i - 1]) = value_rad;
  }
  return posture;
}

}  // namespace

FingerPosture fingers_of_arm(const std::vector<double>& arm_rad) {
  FingerPosture posture;
  posture.spread_rad = arm_rad.at(kSpreadJoint);
  for (std::size_t i = 0; i < kFingerCount; ++i)
    posture.joint_rad[i] = arm_rad.at(static_cast<std::size_t>(kFingerJoint[i]));
  return posture;
}

Result<GraspOptions> load_grasp_options(const std::string& urdf_path, const std::string& postures_path,
                                        const std::string& side) {
  if (side != "left" && side != "right") {
    return Error{ErrorCode::kInvalidArgument, "side is \"" + side + "\"; it must be left or right"};
  }
  auto model_result = RobotModel::load(urdf_path);
  if (!model_result) return model_result.error();
  auto part_result = model_result->part_index(side + "_arm");
  if (!part_result) return part_result.error();
  const Part& arm = model_result->parts()[static_cast<std::size_t>(*part_result)];
  if (arm.axes.size() != kSpreadJoint + kHandJoints) {
    return Error{ErrorCode::kInvalidArgument, urdf_path + ": part " + arm.name + " has " +
                                                  std::to_string(arm.axes.size()) + " axes; 16 are needed"};
  }
  GraspOptions options;
  options.limits.spread_lower_rad = arm.axes[kSpreadJoint].lower_rad;
  options.limits.spread_upper_rad = arm.axes[kSpreadJoint].upper_rad;
  options.rest.spread_rad = arm.axes[kSpreadJoint].home_rad;
  for (std::size_t i = 0; i < kFingerCount; ++i) {
    const Axis& axis = arm.axes[static_cast<std::size_t>(kFingerJoint[i])];
    options.limits.lower_rad[i] = axis.lower_rad;
    options.limits.upper_rad[i] = axis.upper_rad;
    options.rest.joint_rad[i] = axis.home_rad;
  }
  if (!std::filesystem::exists(postures_path)) {
    return Error{ErrorCode::kNotFound, "no grasp postures at " + postures_path};
  }
  YAML::Node file;
  try {
    file = YAML::LoadFile(postures_path);
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument, postures_path + ": " + e.what()};
  }
  const YAML::Node shapes = file["shapes"];
  if (!shapes || !shapes.IsMap() || shapes.size() == 0) {
    return Error{ErrorCode::kInvalidArgument,
                 postures_path + ": expected a map `shapes` with a posture a shape"};
  }
  for (const auto& entry : shapes) {
    const auto shape = entry.first.as<std::string>();
    auto preshape_result =
        read_preshape(entry.second["preshape_deg"], postures_path + ", shape " + shape, options.limits);
    if (!preshape_result) return preshape_result.error();
    options.preshape[shape] = *preshape_result;
  }
  return options;
}

}  // namespace nido::grasp
