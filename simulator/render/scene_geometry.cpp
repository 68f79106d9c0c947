#include "scene_geometry.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "mesh_file.h"
#include "room.h"
#include "textures.h"

namespace nido::sim {
namespace {

constexpr float kInvisible = 0.01F;  // alpha

std::int16_t toFraction16(float value) {
  return static_cast<std::int16_t>(std::lround(std::clamp(value, -1.0F, 1.0F) * 32767.0F));
}

std::uint16_t toUnsignedFraction16(float value) {
  return static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0F, 1.0F) * 65535.0F));
}

bool sameShape(const VisualShape& a, const VisualShape& b) {
  return a.kind == b.kind && a.size == b.size && a.rgba == b.rgba && a.shininess == b.shininess &&
         a.texture == b.texture && a.mesh_path == b.mesh_path;
}

// How many of VisualShape::size a kind uses.
int sizesOf(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::kSphere:
      return 1;
    case ShapeKind::kCylinder:
    case ShapeKind::kCapsule:
      return 2;
    case ShapeKind::kBox:
    case ShapeKind::kMesh:
      return 3;
  }
  return 3;
}

Status checkInstance(const VisualInstance& instance, std::size_t place) {
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorCode::kInvalidArgument,
                 "scene: instance " + std::to_string(place) + " ('" + instance.name + "') " + what};
  };
  const VisualShape& shape = instance.shape;
  if (!instance.X_WorldShape.matrix().allFinite()) return refuse("has a pose that is not finite");
  for (int i = 0; i < sizesOf(shape.kind); ++i) {
    const double size = shape.size[i];
    const bool may_be_zero = shape.kind == ShapeKind::kCapsule && i == 1;
    const bool may_be_negative = shape.kind == ShapeKind::kMesh;
    if (!std::isfinite(size) || (size == 0 && !may_be_zero) || (size < 0 && !may_be_negative)) {
      return refuse("has size[" + std::to_string(i) + "] = " + std::to_string(size) +
                    ", expected a positive length");
    }
  }
  for (const float channel : shape.rgba) {
    if (!std::isfinite(channel)) return refuse("has a colour that is not finite");
  }
  if (!std::isfinite(shape.shininess)) return refuse("has a shininess that is not finite");
  if (textureLayer(shape.texture) == kUnknownTexture) {
    return refuse("asks for texture '" + shape.texture + "'; there are: " + textureNames());
  }
  return {};
}

}  // namespace

SceneGeometry::SceneGeometry(bool with_room) : with_room_(with_room) {}

bool SceneGeometry::sameShapes(const SceneSnapshot& scene) const {
  if (!built_ || scene.instances.size() != shapes_.size()) return false;
  for (std::size_t i = 0; i < shapes_.size(); ++i) {
    if (!sameShape(scene.instances[i].shape, shapes_[i])) return false;
  }
  return true;
}

Result<LocalMesh> SceneGeometry::makeMesh(const VisualShape& shape) {
  switch (shape.kind) {
    case ShapeKind::kBox:
      return makeBox(shape.size);
    case ShapeKind::kSphere:
      return makeSphere(shape.size[0]);
    case ShapeKind::kCylinder:
      return makeCylinder(shape.size[0], shape.size[1]);
    case ShapeKind::kCapsule:
      return makeCapsule(shape.size[0], shape.size[1]);
    case ShapeKind::kMesh:
      break;
  }
  auto known = mesh_files_.find(shape.mesh_path);
  if (known == mesh_files_.end()) {
    Result<LocalMesh> read = readMeshFile(shape.mesh_path);
    if (!read) return read.error();
    known = mesh_files_.emplace(shape.mesh_path, std::move(*read)).first;
  }
  LocalMesh mesh = known->second;
  const Eigen::Vector3f scale = shape.size.cast<float>();
  for (LocalVertex& vertex : mesh.vertices) {
    vertex.p_m = vertex.p_m.cwiseProduct(scale);
    vertex.normal = vertex.normal.cwiseQuotient(scale).normalized();
  }
  if (scale.prod() < 0) {  // a mirror image turns the sense of the triangles
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3)
      std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
  }
  mesh.fitBall();
  return mesh;
}

Result<SceneGeometry::Change> SceneGeometry::update(const SceneSnapshot& scene) {
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    if (Status ok = checkInstance(scene.instances[i], i); !ok) return ok.error();
  }
  if (!sameShapes(scene)) return rebuild(scene);
  moved_ = {static_cast<std::uint32_t>(vertices_.size()), 0};
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    if (piece_of_instance_[i] < 0) continue;
    Piece& piece = pieces_[static_cast<std::size_t>(piece_of_instance_[i])];
    const Eigen::Isometry3d& X = scene.instances[i].X_WorldShape;
    if (X.matrix() == piece.X_WorldShape.matrix()) continue;
    piece.X_WorldShape = X;
    piece.ball_centre_World_m = (X * piece.mesh.centre_m.cast<double>()).cast<float>();
    place(piece);
    moved_[0] = std::min(moved_[0], piece.first_vertex);
    moved_[1] = std::max(moved_[1], piece.first_vertex + piece.vertex_count);
  }
  return moved_[0] < moved_[1] ? Change::kMoved : Change::kNone;
}

Result<SceneGeometry::Change> SceneGeometry::rebuild(const SceneSnapshot& scene) {
  std::vector<VisualInstance> all = scene.instances;
  if (with_room_) {
    for (VisualInstance& part : makeRoom()) all.push_back(std::move(part));
  }
  std::vector<Piece> pieces;
  std::vector<std::size_t> instance_of_piece;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const VisualInstance& instance = all[i];
    if (instance.shape.rgba[3] < kInvisible) continue;
    Result<LocalMesh> mesh = makeMesh(instance.shape);
    if (!mesh) {
      return Error{mesh.error().code, "scene: instance " + std::to_string(i) + " ('" + instance.name +
                                          "'): " + mesh.error().message};
    }
    Piece piece{};
    piece.shape = instance.shape;
    piece.X_WorldShape = instance.X_WorldShape;
    piece.mesh = std::move(*mesh);
    const bool textured = !instance.shape.texture.empty();
    piece.batch = piece.mesh.closed ? (textured ? Batch::kTextured : Batch::kPlain)
                                    : (textured ? Batch::kTwoSidedTextured : Batch::kTwoSided);
    const bool of_room = i >= scene.instances.size();
    piece.casts_shadow = !of_room;
    piece.id = of_room ? 0 : static_cast<std::uint32_t>(i + 1);
    piece.ball_centre_World_m = (piece.X_WorldShape * piece.mesh.centre_m.cast<double>()).cast<float>();
    piece.ball_radius_m = piece.mesh.radius_m;
    pieces.push_back(std::move(piece));
    instance_of_piece.push_back(i);
  }
  std::vector<std::size_t> order(pieces.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return pieces[a].batch < pieces[b].batch; });

  // nothing below can fail: take over
  pieces_.clear();
  indices_.clear();
  shapes_.clear();
  for (const VisualInstance& instance : scene.instances) shapes_.push_back(instance.shape);
  piece_of_instance_.assign(all.size(), -1);
  std::uint32_t vertex_count = 0;
  for (const std::size_t o : order) {
    Piece piece = std::move(pieces[o]);
    piece.first_vertex = vertex_count;
    piece.vertex_count = static_cast<std::uint32_t>(piece.mesh.vertices.size());
    piece.first_index = static_cast<std::uint32_t>(indices_.size());
    piece.index_count = static_cast<std::uint32_t>(piece.mesh.indices.size());
    for (const std::uint32_t index : piece.mesh.indices) indices_.push_back(vertex_count + index);
    vertex_count += piece.vertex_count;
    piece_of_instance_[instance_of_piece[o]] = static_cast<int>(pieces_.size());
    pieces_.push_back(std::move(piece));
  }
  vertices_.resize(vertex_count);
  for (const Piece& piece : pieces_) place(piece);
  moved_ = {0, vertex_count};
  built_ = true;
  return Change::kRebuilt;
}

void SceneGeometry::place(const Piece& piece) {
  const Eigen::Matrix3f R = piece.X_WorldShape.linear().cast<float>();
  const Eigen::Vector3f t = piece.X_WorldShape.translation().cast<float>();
  const std::int16_t shininess = toFraction16(piece.shape.shininess / 128.0F);
  const int layer = textureLayer(piece.shape.texture);
  const float repeat = layer >= 0 ? 1.0F / texturePatterns()[static_cast<std::size_t>(layer)].tile_m : 0.0F;
  GpuVertex vertex{};
  for (int i = 0; i < 4; ++i)
    vertex.colour[i] = toUnsignedFraction16(piece.shape.rgba[static_cast<std::size_t>(i)]);
  vertex.normal_shininess[3] = shininess;
  vertex.texture[2] = static_cast<float>(layer);
  vertex.id = piece.id;
  GpuVertex* out = vertices_.data() + piece.first_vertex;
  for (const LocalVertex& local : piece.mesh.vertices) {
    const Eigen::Vector3f p = R * local.p_m + t;
    const Eigen::Vector3f n = 32767.0F * (R * local.normal);
    for (int i = 0; i < 3; ++i) {
      vertex.p_m[i] = p[i];
      vertex.normal_shininess[i] = static_cast<std::int16_t>(std::clamp(n[i], -32767.0F, 32767.0F));
    }
    vertex.texture[0] = local.uv_m.x() * repeat;
    vertex.texture[1] = local.uv_m.y() * repeat;
    *out++ = vertex;
  }
}

}  // namespace nido::sim
