#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/simulator/simulation.h"
#include "object_joints.h"
#include "objects.h"

namespace nido::sim {

// A world before it is built. Objects stand where they shall be at the start.
struct WorldDescription {
  std::vector<ObjectDescription> objects;  // the table first, if there is one
  std::vector<ObjectJointDescription> joints;
  std::optional<Lighting> light;  // nothing: as it is
  // Where joints stand at the start instead of at home: part name, angles of its joints in rad. Checked by
  // the drives.
  std::vector<std::pair<std::string, std::vector<double>>> posture_rad;
};

// Reads the world that the options name; docs/world.md describes the file. Random worlds are drawn here.
Result<WorldDescription> read_world(const SimulationOptions& options);

// Common looks and shapes, also for the world vocabulary.
[[nodiscard]] ObjectDescription make_simple(const std::string& name, const std::string& kind, ShapeKind shape,
                                            const Eigen::Vector3d& size, double mass_kg,
                                            const std::array<float, 3>& rgb);
// Height of the object's frame above the lowest point of the object in this orientation.
[[nodiscard]] double standing_height(const ObjectDescription& object, const Eigen::Matrix3d& R_WorldObject);

}  // namespace nido::sim
