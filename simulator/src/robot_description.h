#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "shapes.h"

namespace nido::sim {

// A frame of the URDF that moves with a link: the link itself, or one that hangs on it by fixed joints.
struct NamedFrame {
  std::string name;
  Eigen::Isometry3d X_LinkFrame = Eigen::Isometry3d::Identity();
};

// A shape and the URDF link that it came from.
struct LinkShape {
  PlacedShape placed;  // in the frame of the moving link
  std::string urdf_link;
};

// What a link can do against the one that it hangs on: turn about its hinge, or, as one of the six degrees of
// freedom of a base that stands free (robot_base.h), slide along or turn about an axis of the world.
enum class Freedom { kHinge, kBaseSlide, kBaseTurn };

// Links 1 to 6 of a robot whose base is free: it slides along x, y, z and turns about them. The sixth is the
// root group itself, the others are nothing.
inline constexpr std::size_t kBaseDegrees = 6;
inline constexpr std::size_t kFirstBaseTurn = 4;

// All URDF links that move as one, by the hinge that moves them. Link 0 is fixed to the world: the root
// group, or nothing where the base is free.
struct LinkDescription {
  Freedom freedom = Freedom::kHinge;
  std::string name;                                                // URDF link right after the hinge
  int parent = 0;                                                  // index, always smaller than the own one
  std::string joint_name;                                          // of the hinge
  Eigen::Isometry3d X_ParentLink = Eigen::Isometry3d::Identity();  // at angle zero; X_WorldLink for link 0
  Eigen::Vector3d axis_Link = Eigen::Vector3d::UnitZ();
  double min_rad = 0;
  double max_rad = 0;
  double max_velocity_rad_s = 0;
  double max_torque_Nm = 0;
  MassProperties mass;  // in the link frame
  std::vector<LinkShape> collisions;
  std::vector<LinkShape> visuals;
  std::vector<NamedFrame> frames;
};

struct RobotDescription {
  std::string name;
  std::vector<LinkDescription> links;
};

// Reads a URDF whose moving joints are all hinges.
Result<RobotDescription> read_robot(const std::filesystem::path& urdf_path);

}  // namespace nido::sim
