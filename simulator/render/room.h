#pragma once

#include <vector>

#include "nido/simulator/scene.h"

namespace nido::sim {

// Floor, walls and ceiling around the robot, of low saturation so that coloured things stand out.
std::vector<VisualInstance> makeRoom();

}  // namespace nido::sim
