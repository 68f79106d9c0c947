#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace nido::sim {

struct LocalVertex {
  Eigen::Vector3f p_m;
  Eigen::Vector3f normal;
  Eigen::Vector2f uv_m;  // place on the surface, in metres
};

// Triangles in the frame of a shape, counter-clockwise seen from outside.
struct LocalMesh {
  std::vector<LocalVertex> vertices;
  std::vector<std::uint32_t> indices;
  // Every edge belongs to two triangles of opposite sense, so that nobody can see a back side from outside.
  bool closed = true;
  // A ball around all vertices.
  Eigen::Vector3f centre_m = Eigen::Vector3f::Zero();
  float radius_m = 0;

  void fitBall();
};

// Edge lengths x, y, z; the edges are slightly bevelled within that size. The surface runs along the longest
// edge in u.
LocalMesh makeBox(const Eigen::Vector3d& size_m);

// Round shapes are polygons of the same area as the circles they stand for, finer for larger radii, so that
// the centroid and the size of their picture are not biased.
LocalMesh makeSphere(double radius_m);
LocalMesh makeCylinder(double radius_m, double length_m);
// The half balls come on top of the length.
LocalMesh makeCapsule(double radius_m, double length_m);

}  // namespace nido::sim
