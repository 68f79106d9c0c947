#pragma once

#include <Eigen/Geometry>
#include <set>
#include <string>
#include <vector>

#include "nido/middleware/node.h"

namespace nido::reach {

// The world as it really is, for experimenters alone, through the world port: things that float where they
// are put, and where a palm is. Root frame.
class TrialWorld {
 public:
  // A sphere of 6 cm that nothing moves.
  struct Sphere {
    int number = 1;  // among spheres, in the order in which they were put first
    const char* colour = "";
    bool touches_robot = false;
  };
  static constexpr Sphere kBall = {1, "0.85 0.05 0.05", false};  // to be seen and reached
  static constexpr Sphere kFist = {2, "0.45 0.45 0.45", true};   // a person's, to lead the hand

  explicit TrialWorld(Node& node) : node_(node) {}

  Status put(const Sphere& sphere, const Eigen::Vector3d& p_Root_m);
  // side: "right" or "left".
  Result<Eigen::Isometry3d> X_RootPalm(const std::string& side);
  Result<Eigen::Vector3d> mark_Root_m(const std::string& side, const Eigen::Vector3d& p_PalmMark_m);

 private:
  Result<std::vector<double>> numbers(const std::string& line, std::size_t count);

  Node& node_;
  std::set<int> made_;
};

}  // namespace nido::reach
