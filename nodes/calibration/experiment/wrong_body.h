#pragma once

#include <cstdint>
#include <filesystem>

#include "nido/interfaces/result.h"
#include "nido/kinematics/body_corrections.h"

namespace nido::calibration {

// A body that is not built as drawn: zeros of neck, eyes and arm off by 2.5 degrees (standard deviation),
// eyes turned in their sockets by 1.5 degrees and moved by 2 mm, upper arm and forearm longer or shorter by 5
// mm.
BodyCorrections draw_wrong_body(std::uint64_t seed, const std::string& side);

// The robot files icub_sim and icub_sim_babbling with this body, in `folder`, to be given to `nido launch
// --robot`. `robots` is config/robots. kFailed with the path.
Status write_robot(const std::filesystem::path& robots, const BodyCorrections& body,
                   const std::filesystem::path& folder);

}  // namespace nido::calibration
