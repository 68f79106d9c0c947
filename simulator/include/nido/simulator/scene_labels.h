#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nido/simulator/scene.h"

namespace nido::sim {

// Names of all that is in a scene, each once. The label of a name is its place plus one; 0 is the room.
[[nodiscard]] std::vector<std::string> scene_labels(const SceneSnapshot& scene);
// The label of each instance.
[[nodiscard]] std::vector<std::uint16_t> instance_labels(const SceneSnapshot& scene);

}  // namespace nido::sim
