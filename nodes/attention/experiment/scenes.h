#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace nido::attention {

// What a thing of config/worlds/attention.yaml is made of; its frame is in the middle, z along a cylinder.
struct Thing {
  enum class Shape { kBox, kBall, kCylinder };
  std::string name;
  Shape shape = Shape::kBox;
  // box: edges; ball: radius, -, -; cylinder: radius, length, -
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  [[nodiscard]] double half_height_m() const;
};
// The things of the world file, the attended ones first.
const std::vector<Thing>& things();

// A thing at a place.
struct Placed {
  int thing = 0;  // index into things()
  Eigen::Isometry3d X_RootThing = Eigen::Isometry3d::Identity();
};

// One trial: what is attended to, how it moves, and what else is there.
struct Scene {
  int number = 0;
  bool moving = false;
  bool clutter = false;
  Placed target;
  std::vector<Placed> others;  // rest
  Eigen::Vector3d p_RootHint_m =
      Eigen::Vector3d::Zero();  // where the robot is told to look: 1.5 cm off or so
  // path: sums of two sines an axis, from rest
  struct Sway {
    std::array<double, 2> amplitude{};
    std::array<double, 2> frequency_rad_s{};
    std::array<double, 2> phase_rad{};
  };
  std::array<Sway, 3> sway;
  Sway turn;
};

// Scene `number` of a seed: static alone, static in clutter, moving alone, moving in clutter, and again.
Scene make_scene(std::uint64_t seed, int number);

// Where the target is at a time since the scene began.
Eigen::Isometry3d target_at(const Scene& scene, double time_s);

}  // namespace nido::attention
