#pragma once

#include <cstdint>
#include <vector>

namespace nido::sim {

// What lies behind each pixel's centre; rows from top to bottom.
struct DepthImage {
  int width = 0;
  int height = 0;
  std::vector<float> z_m;  // along the optical axis; 0 where nothing is
  // Position in SceneSnapshot::instances plus one; 0: the room or nothing.
  std::vector<std::uint32_t> instance;
};

}  // namespace nido::sim
