#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace nido::sim {

inline constexpr int kTextureSize = 256;  // texels along an edge
inline constexpr int kNoTexture = -1;

// A pattern that multiplies a shape's colour; it repeats without seams.
struct TexturePattern {
  std::string_view name;
  float tile_m = 1;     // edge of one repetition on the surface
  float strongest = 1;  // colour factor of the texel value 255
  std::vector<std::uint8_t> (*make)();
};

// All patterns; their places are the layers of the texture array.
const std::vector<TexturePattern>& texturePatterns();

// Layer of a pattern, kNoTexture for "", nothing (-2) for an unknown name.
int textureLayer(std::string_view name);
inline constexpr int kUnknownTexture = -2;

// The names that shapes may use, for messages: "checker, wood, ...".
std::string textureNames();

}  // namespace nido::sim
