#pragma once

#include <string>

#include "geometry.h"
#include "nido/interfaces/result.h"

namespace nido::sim {

// Reads the triangles of a mesh file (OBJ, STL, DAE, ...); "file://" in front of the path is allowed. Normals
// and places on the surface are made up where the file has none. Fails naming the file and what is wrong with
// it.
Result<LocalMesh> readMeshFile(const std::string& path);

}  // namespace nido::sim
