#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace nido::grasp {

// Touch pads of a hand, in the order thumb, index, middle, ring, little finger tip, palm.
inline constexpr std::size_t kPadCount = 6;

// The eight finger joints that grasping uses (the paper's Table III), as joints of the arm part (iCub order).
inline constexpr std::size_t kFingerCount = 8;
inline constexpr std::array<int, kFingerCount> kFingerJoint = {8, 9, 10, 11, 12, 13, 14, 15};
inline constexpr std::array<const char*, kFingerCount> kFingerName = {
    "thumb opposition", "thumb proximal",  "thumb distal",  "index proximal",
    "index distal",     "middle proximal", "middle distal", "ring and little"};

// The joint that spreads the fingers; not part of the network, set by the pre-shape.
inline constexpr int kSpreadJoint = 7;

// Pads whose touch stops a finger joint: the tip of its own finger (ring and little share a joint).
inline constexpr std::array<std::array<int, 2>, kFingerCount> kPadOfFinger = {
    {{-1, -1}, {0, -1}, {0, -1}, {1, -1}, {1, -1}, {2, -1}, {2, -1}, {3, 4}}};

// Limits of the joints 7..15 of one arm, rad.
struct FingerLimits {
  double spread_lower_rad = 0;
  double spread_upper_rad = 0;
  std::array<double, kFingerCount> lower_rad{};
  std::array<double, kFingerCount> upper_rad{};
};

// A posture of the fingers, rad, within the limits.
struct FingerPosture {
  double spread_rad = 0;
  std::array<double, kFingerCount> joint_rad{};
};

}  // namespace nido::grasp
