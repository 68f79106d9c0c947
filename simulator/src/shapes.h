#pragma once

#include <ode/ode.h>

#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/simulator/scene.h"

namespace nido::sim {

// Triangles of a mesh file in the frame of its owner, scaled.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices_m;
  std::vector<std::array<int, 3>> triangles;
};

// One shape of a link or object: looks and collision are the same unless told otherwise.
struct PlacedShape {
  VisualShape shape;
  Eigen::Isometry3d X_OwnerShape = Eigen::Isometry3d::Identity();
  double mass_kg = 0;                          // share of an object's mass; unused for links
  std::shared_ptr<const TriangleMesh> mesh{};  // only for meshes; may be shared by many objects
};

// Mass, centre and inertia about the centre, all in the owner's frame.
struct MassProperties {
  double mass_kg = 0;
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia_kgm2 = Eigen::Matrix3d::Zero();
};

// Of a shape of even density.
[[nodiscard]] MassProperties mass_of(const PlacedShape& placed);
// Of several things that move as one.
[[nodiscard]] MassProperties combine(const std::vector<MassProperties>& parts);

// Corners of the shape's box in the owner's frame, appended to the bounds.
void extend_bounds(const PlacedShape& placed, Eigen::AlignedBox3d& bounds);

// Makes the collision geom of a shape; nullptr for an empty mesh. `mesh_data` receives the data that must
// outlive the geom.
[[nodiscard]] dGeomID make_geom(const PlacedShape& placed, std::vector<dTriMeshDataID>& mesh_data);

// Places a geom that belongs to a body: X_BodyShape, or X_WorldShape when it has no body.
void place_geom(dGeomID geom, dBodyID body, const Eigen::Isometry3d& X);

// Reads OBJ, STL or DAE; scales; refuses files that are missing, empty, not finite or beyond 200 000
// triangles.
Result<std::shared_ptr<const TriangleMesh>> load_mesh(const std::string& path, const Eigen::Vector3d& scale);

}  // namespace nido::sim
