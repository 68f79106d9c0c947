#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <filesystem>

#include "shapes.h"

namespace nido::sim {

Result<std::shared_ptr<const TriangleMesh>> load_mesh(const std::string& path, const Eigen::Vector3d& scale) {
  constexpr std::size_t kMostTriangles = 200000;
  constexpr double kFarthest_m = 1e4;  // beyond it inertias are no longer numbers that mean something
  std::error_code trouble;             // a name may be longer than any file system takes
  if (!std::filesystem::is_regular_file(path, trouble))
    return Error{ErrorCode::kNotFound, "there is no mesh file " + path};
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate | aiProcess_JoinIdenticalVertices |
                                                     aiProcess_PreTransformVertices | aiProcess_SortByPType |
                                                     aiProcess_FindDegenerates);
  if (scene == nullptr || scene->mNumMeshes == 0) {
    return Error{ErrorCode::kInvalidArgument,
                 "cannot read the mesh " + path + ": " + importer.GetErrorString()};
  }
  auto mesh = std::make_shared<TriangleMesh>();
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& part = *scene->mMeshes[m];
    const int first = static_cast<int>(mesh->vertices_m.size());
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const aiVector3D& p = part.mVertices[v];
      mesh->vertices_m.emplace_back(scale.cwiseProduct(Eigen::Vector3d(p.x, p.y, p.z)));
      if (!mesh->vertices_m.back().allFinite()) {
        return Error{ErrorCode::kInvalidArgument, "the mesh " + path + " has a vertex that is not a number"};
      }
      if (mesh->vertices_m.back().cwiseAbs().maxCoeff() > kFarthest_m) {
        return Error{ErrorCode::kInvalidArgument, "the mesh " + path + " has a vertex more than 10 km away"};
      }
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      mesh->triangles.push_back({first + static_cast<int>(face.mIndices[0]),
                                 first + static_cast<int>(face.mIndices[1]),
                                 first + static_cast<int>(face.mIndices[2])});
    }
    if (mesh->triangles.size() > kMostTriangles) {
      return Error{ErrorCode::kInvalidArgument,
                   "the mesh " + path + " has more than " + std::to_string(kMostTriangles) + " triangles"};
    }
  }
  if (mesh->triangles.empty())
    return Error{ErrorCode::kInvalidArgument, "the mesh " + path + " has no triangles"};
  // ODE keeps no tree for a single triangle and then follows a null pointer when two meshes meet: give it its
  // back side
  if (mesh->triangles.size() == 1) {
    const std::array<int, 3> front = mesh->triangles.front();
    mesh->triangles.push_back({front[0], front[2], front[1]});
  }
  return std::shared_ptr<const TriangleMesh>(mesh);
}

}  // namespace nido::sim
