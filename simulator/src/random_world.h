#pragma once

#include <functional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/simulator/simulation.h"
#include "objects.h"
#include "yaml_reader.h"

namespace nido::sim {

// Draws the `random:` section of a world file (docs/world.md): the target, distractors and a basket at places
// that do not overlap. Everything follows from options.seed. Fails when a name is unknown or there is no
// room.
Status place_at_random(YamlReader section, const SimulationOptions& options, double table_height_m,
                       const std::function<Result<ObjectDescription>(const std::string&)>& named,
                       std::vector<ObjectDescription>& objects);

}  // namespace nido::sim
