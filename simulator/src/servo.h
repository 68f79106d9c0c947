#pragma once

#include "nido/simulator/joints.h"

namespace nido::sim {

// A servo is no wall: it gives all its torque when the joint stands so far from where it should.
inline constexpr double kServoGive_rad = 0.02;
inline constexpr double kWeakShare = 0.2;   // of its torque that a weak motor has left
inline constexpr double kStuckShare = 100;  // a stuck gear bears more than any motor gives

// The joint follows a reference.
[[nodiscard]] constexpr bool is_servo(JointMode mode) {
  return mode == JointMode::kPosition || mode == JointMode::kDirect || mode == JointMode::kVelocity;
}

}  // namespace nido::sim
