#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

namespace nido::sim {

// One sensor of a patch of skin.
struct Taxel {
  int value = 0;                                        // place among the values of its patch
  Eigen::Vector3d p_Link_m = Eigen::Vector3d::Zero();   // on the skin; in the frame of the patch's URDF link
  Eigen::Vector3d out_Link = Eigen::Vector3d::UnitZ();  // out of the body
};

// A patch of skin on a link. Its port has room for `values` numbers, of which those of its taxels mean
// something and the others are 0, as on the robot.
struct SkinPatch {
  std::string name;  // "left_forearm"
  std::string link;  // URDF link that wears it
  std::size_t values = 0;
  std::vector<Taxel> taxels;  // in the order of their values
};

// What a taxel feels: normal force, mean over the last control period.
struct TaxelForce {
  int value = 0;
  double force_N = 0;  // above 0
  friend bool operator==(const TaxelForce&, const TaxelForce&) = default;
};

}  // namespace nido::sim
