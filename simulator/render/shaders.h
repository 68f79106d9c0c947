#pragma once

#include <string>

namespace nido::sim {

// GLSL 3.30 sources. Attributes: 0 place in the world, 1 normal and shininess / 128, 2 colour, 3 place in the
// texture and its layer, 4 instance id.
std::string litVertexShader(bool textured);
std::string litFragmentShader(bool textured);
std::string shadowVertexShader();
std::string shadowFragmentShader();
std::string idVertexShader();
std::string idFragmentShader();

}  // namespace nido::sim
