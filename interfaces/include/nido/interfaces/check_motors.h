#pragma once

#include <array>
#include <cmath>
#include <span>

#include "nido/interfaces/check_joints.h"
#include "nido/interfaces/motors.h"

namespace nido {

// The checks that every board makes of gains and impedances (motors.h).
[[nodiscard]] inline Status check_pids(int axes, std::span<const int> joints, std::span<const Pid> pids) {
  if (joints.size() != pids.size()) {
    return Error{ErrorCode::kInvalidArgument, std::to_string(joints.size()) + " joints but gains for " +
                                                  std::to_string(pids.size()) + ": one a joint is expected"};
  }
  if (Status joints_ok = check_joints(axes, joints); !joints_ok) return joints_ok;
  for (std::size_t i = 0; i < pids.size(); ++i) {
    const Pid& p = pids[i];
    for (const double gain : {p.kp, p.kd, p.ki, p.max_integral, p.max_output, p.scale, p.kff}) {
      if (!std::isfinite(gain) || gain < 0) {
        return Error{ErrorCode::kInvalidArgument, "gains of joint " + std::to_string(joints[i]) + " hold " +
                                                      std::to_string(gain) +
                                                      ": expected are finite numbers from 0 on"};
      }
    }
    for (const double term : {p.offset, p.stiction_up, p.stiction_down}) {
      if (!std::isfinite(term)) {
        return Error{ErrorCode::kInvalidArgument,
                     "gains of joint " + std::to_string(joints[i]) + " hold a number that is not finite"};
      }
    }
  }
  return {};
}

[[nodiscard]] inline Status check_impedances(int axes, std::span<const int> joints,
                                             std::span<const Impedance> impedances) {
  if (joints.size() != impedances.size()) {
    return Error{ErrorCode::kInvalidArgument, std::to_string(joints.size()) + " joints but " +
                                                  std::to_string(impedances.size()) +
                                                  " impedances: one a joint is expected"};
  }
  if (Status joints_ok = check_joints(axes, joints); !joints_ok) return joints_ok;
  for (std::size_t i = 0; i < impedances.size(); ++i) {
    const Impedance& z = impedances[i];
    if (!std::isfinite(z.stiffness_Nm_rad) || z.stiffness_Nm_rad < 0 || !std::isfinite(z.damping_Nms_rad) ||
        z.damping_Nms_rad < 0 || !std::isfinite(z.offset_Nm)) {
      return Error{ErrorCode::kInvalidArgument,
                   "the impedance of joint " + std::to_string(joints[i]) +
                       " is not possible: stiffness and damping are finite numbers from 0 on"};
    }
  }
  return {};
}

}  // namespace nido
