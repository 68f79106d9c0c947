#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "geometry.h"
#include "nido/interfaces/result.h"
#include "nido/simulator/scene.h"

namespace nido::sim {

// A vertex as the graphics library gets it: already in the world frame, so that all shapes go into one draw
// call.
struct GpuVertex {
  float p_m[3];
  std::int16_t normal_shininess[4];  // normal, shininess / 128, as fractions of 32767
  std::uint16_t colour[4];           // fractions of 65535, linear
  float texture[3];                  // place in the pattern in repetitions, layer
  std::uint32_t id;
};

// Shapes that are drawn in the same way.
enum class Batch { kPlain, kTextured, kTwoSided, kTwoSidedTextured };
inline constexpr std::size_t kBatchCount = 4;

// One instance in the big buffers.
struct Piece {
  VisualShape shape;
  Eigen::Isometry3d X_WorldShape;
  Batch batch;
  std::uint32_t first_vertex;
  std::uint32_t vertex_count;
  std::uint32_t first_index;  // place in the index buffer
  std::uint32_t index_count;
  bool casts_shadow;
  std::uint32_t id;
  LocalMesh mesh;  // scaled, in the shape's frame
  Eigen::Vector3f ball_centre_World_m;
  float ball_radius_m;
};

// The triangles of a scene, and of the room around it, in the world frame.
class SceneGeometry {
 public:
  explicit SceneGeometry(bool with_room);

  // What an update did: nothing, moved vertices, or new buffers.
  enum class Change { kNone, kMoved, kRebuilt };

  // Fails, and changes nothing, with a sentence that names the instance.
  Result<Change> update(const SceneSnapshot& scene);

  [[nodiscard]] const std::vector<GpuVertex>& vertices() const { return vertices_; }
  [[nodiscard]] const std::vector<std::uint32_t>& indices() const { return indices_; }
  // Sorted by batch.
  [[nodiscard]] const std::vector<Piece>& pieces() const { return pieces_; }
  // First and one past the last vertex that the last update moved.
  [[nodiscard]] std::array<std::uint32_t, 2> moved() const { return moved_; }

 private:
  Result<LocalMesh> makeMesh(const VisualShape& shape);
  [[nodiscard]] bool sameShapes(const SceneSnapshot& scene) const;
  Result<Change> rebuild(const SceneSnapshot& scene);
  void place(const Piece& piece);

  bool with_room_;
  bool built_ = false;
  std::map<std::string, LocalMesh> mesh_files_;  // by path, unscaled
  std::vector<Piece> pieces_;
  std::vector<int> piece_of_instance_;  // -1: invisible
  std::vector<VisualShape> shapes_;     // of the instances, as they were at the last rebuild
  std::vector<GpuVertex> vertices_;
  std::vector<std::uint32_t> indices_;
  std::array<std::uint32_t, 2> moved_{};
};

}  // namespace nido::sim
