#pragma once

#include <string>

#include "nido/grasp/grasp_core.h"
#include "nido/interfaces/result.h"

namespace nido::grasp {

// Finger limits from the body's URDF and pre-shapes from a postures file (config/robots/grasp_postures.yaml).
// kNotFound, kInvalidArgument with file and place. side: "left" or "right".
Result<GraspOptions> load_grasp_options(const std::string& urdf_path, const std::string& postures_path,
                                        const std::string& side);

// Picks joints 7..15 out of an arm's sixteen positions.
FingerPosture fingers_of_arm(const std::vector<double>& arm_rad);

}  // namespace nido::grasp
