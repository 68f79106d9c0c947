#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "nido/interfaces/depth_camera.h"
#include "nido/middleware/node.h"
#include "nido/wrappers/server.h"

namespace nido {

// A depth camera on the network: `STEM/depth:o` (sensor_msgs/Image 32FC1, m along the optical axis) and
// `STEM/segmentation:o` (16UC1: labels, which `world labels` names), both only while somebody is connected.
// Node and camera must outlive the server.
Result<std::unique_ptr<IServer>> serve_depth(Node& node, const std::string& stem, IDepthCamera& camera,
                                             std::int64_t period_ns, const std::string& frame_id);

}  // namespace nido
