#include "mesh_file.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

namespace nido::sim {
namespace {

constexpr std::size_t kMaxVertices = 2'000'000;

// True if every edge of the surface, by the places of its ends, is passed once in each direction.
bool isClosed(const LocalMesh& mesh) {
  std::map<std::array<float, 3>, int> places;
  std::vector<int> place_of(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f& p = mesh.vertices[i].p_m;
    place_of[i] = places.try_emplace({p.x(), p.y(), p.z()}, static_cast<int>(places.size())).first->second;
  }
  std::map<std::pair<int, int>, int> balance;
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = place_of[mesh.indices[i + k]];
      const int b = place_of[mesh.indices[i + (k + 1) % 3]];
      if (a == b) continue;
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  for (const auto& [edge, sum] : balance) {
    if (sum != 0) return false;
  }
  return true;
}

// Where a point lies on its surface when the file does not say: seen along the axis that the normal is
// nearest to.
Eigen::Vector2f flatPlace(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return {p_m[(axis + 1) % 3], p_m[(axis + 2) % 3]};
}

}  // namespace

Result<LocalMesh> readMeshFile(const std::string& path) {
  std::string file = path;
  if (file.starts_with("file://")) file.erase(0, 7);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return Error{ErrorCode::kNotFound, "mesh file " + file + " does not exist"};
  }
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(
      file, aiProcess_Triangulate | aiProcess_GenSmoothNormals | aiProcess_JoinIdenticalVertices |
                aiProcess_PreTransformVertices | aiProcess_ImproveCacheLocality);
  if (scene == nullptr) {
    return Error{ErrorCode::kInvalidArgument,
                 "mesh file " + file + " cannot be read: " + importer.GetErrorString()};
  }
  LocalMesh mesh;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& part = *scene->mMeshes[m];
    if (!part.HasNormals()) continue;  // points and lines
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    if (mesh.vertices.size() + part.mNumVertices > kMaxVertices) {
      return Error{ErrorCode::kInvalidArgument,
                   "mesh file " + file + " has more than " + std::to_string(kMaxVertices) + " vertices"};
    }
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const aiVector3D& p = part.mVertices[v];
      const aiVector3D& n = part.mNormals[v];
      LocalVertex vertex{{p.x, p.y, p.z}, {n.x, n.y, n.z}, {0, 0}};
      if (!vertex.p_m.allFinite() || !vertex.normal.allFinite()) {
        return Error{ErrorCode::kInvalidArgument, "mesh file " + file +
                                                      " has a vertex or normal that is not finite (vertex " +
                                                      std::to_string(mesh.vertices.size()) + ")"};
      }
      if (part.HasTextureCoords(0)) {
        vertex.uv_m = {part.mTextureCoords[0][v].x, part.mTextureCoords[0][v].y};
      } else {
        vertex.uv_m = flatPlace(vertex.p_m, vertex.normal);
      }
      mesh.vertices.push_back(vertex);
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      for (unsigned k = 0; k < 3; ++k) mesh.indices.push_back(first + face.mIndices[k]);
    }
  }
  if (mesh.indices.empty()) {
    return Error{ErrorCode::kInvalidArgument, "mesh file " + file + " has no triangles"};
  }
  mesh.closed = isClosed(mesh);
  mesh.fitBall();
  return mesh;
}

}  // namespace nido::sim
