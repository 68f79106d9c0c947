#pragma once

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// The checks that every control board makes of a list of joints (motor_control.h, "Rules for all of them").
[[nodiscard]] inline Status check_joints(int axes, std::span<const int> joints) {
  std::vector<bool> seen(static_cast<std::size_t>(axes), false);
  for (const int joint : joints) {
    if (joint < 0 || joint >= axes) {
      return Error{
          ErrorCode::kInvalidArgument,
          "joint " + std::to_string(joint) + " does not exist: joints are 0.." + std::to_string(axes - 1)};
    }
    if (seen[static_cast<std::size_t>(joint)]) {
      return Error{ErrorCode::kInvalidArgument, "joint " + std::to_string(joint) + " is named twice"};
    }
    seen[static_cast<std::size_t>(joint)] = true;
  }
  return {};
}

// The same, with a value for each joint.
[[nodiscard]] inline Status check_joint_values(int axes, std::span<const int> joints,
                                               std::span<const double> values) {
  if (joints.size() != values.size()) {
    return Error{ErrorCode::kInvalidArgument, std::to_string(joints.size()) + " joints but " +
                                                  std::to_string(values.size()) +
                                                  " values: one a joint is expected"};
  }
  if (Status joints_ok = check_joints(axes, joints); !joints_ok) return joints_ok;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) {
      return Error{ErrorCode::kInvalidArgument, "value " + std::to_string(values[i]) + " for joint " +
                                                    std::to_string(joints[i]) + " is not finite"};
    }
  }
  return {};
}

// Values that must also be above zero: speeds, accelerations.
[[nodiscard]] inline Status check_joint_magnitudes(int axes, std::span<const int> joints,
                                                   std::span<const double> values) {
  if (Status values_ok = check_joint_values(axes, joints, values); !values_ok) return values_ok;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] <= 0) {
      return Error{ErrorCode::kInvalidArgument, "value " + std::to_string(values[i]) + " for joint " +
                                                    std::to_string(joints[i]) + " is not above zero"};
    }
  }
  return {};
}

// 0, 1, ... axes-1.
[[nodiscard]] inline std::vector<int> all_joints(int axes) {
  std::vector<int> joints(static_cast<std::size_t>(axes));
  for (int joint = 0; joint < axes; ++joint) joints[static_cast<std::size_t>(joint)] = joint;
  return joints;
}

}  // namespace nido
