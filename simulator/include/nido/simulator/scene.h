#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

namespace nido::sim {

// The simulator's world frame W: axes as the iCub root frame (x backward, y to the robot's right, z up),
// origin where the root is at the start, 0.5976 m above the floor. The world port converts to the old
// simulator's frame.

// What something looks like.
enum class ShapeKind { kBox, kSphere, kCylinder, kCapsule, kMesh };

struct VisualShape {
  ShapeKind kind = ShapeKind::kBox;
  // box: edge lengths x, y, z. sphere: radius in [0]. cylinder, capsule: radius in [0], length along z in [1]
  // (a capsule's caps come on top of the length). mesh: scale factors. m
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  std::string mesh_path;                     // only for meshes: OBJ, STL or DAE file
  std::array<float, 4> rgba = {1, 1, 1, 1};  // linear 0..1
  std::string texture;                       // "", or a procedural one: "checker", "wood", "fabric"
  float shininess = 8.0F;                    // Phong exponent; 0: matt
};

// One thing to draw.
struct VisualInstance {
  std::string name;  // link or object that it belongs to
  VisualShape shape;
  Eigen::Isometry3d X_WorldShape = Eigen::Isometry3d::Identity();
};

// The lamps of the room. All values are linear; 1 is normal.
struct Lighting {
  double brightness = 1.0;  // scales all light, the ambient too: 0.5 is a dim room
  double key = 1.0;         // the ceiling lamp, which casts shadows
  double fill = 1.0;        // a weak lamp on the other side, without shadows
  double ambient = 1.0;     // light from everywhere
  Eigen::Vector3d key_direction_World = {-0.35, -0.45, 1.0};  // towards the lamp; any length but zero
  bool shadows = true;
  friend bool operator==(const Lighting&, const Lighting&) = default;
};

// Everything that a camera can see at one moment. Shapes keep their order from frame to frame unless
// `revision` changes, so that a renderer may keep its buffers.
struct SceneSnapshot {
  std::uint64_t revision = 0;
  std::vector<VisualInstance> instances;
  Lighting light;
};

}  // namespace nido::sim
