#pragma once

#include "objects.h"
#include "robot_description.h"
#include "world_file.h"

namespace nido::sim {

// Frees the base: puts its six degrees of freedom between the world and the root group.
void free_base(RobotDescription& robot);

// The world that the options name, with the stand when they want one, behind everything else. Refused when
// something else in it is called as the stand is.
[[nodiscard]] Result<WorldDescription> read_world_with_base(const SimulationOptions& options,
                                                            const RobotDescription& robot);

// A stand that holds the root: a plate on the floor behind the feet, a pole, and an arm to the back of the
// root's shapes. It never moves and can be touched like any object.
[[nodiscard]] ObjectDescription make_stand(const RobotDescription& robot);

}  // namespace nido::sim
