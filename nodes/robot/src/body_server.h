#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "nido/interfaces/control_board.h"
#include "nido/middleware/node.h"
#include "nido/wrappers/server.h"

namespace nido {

// /tf: where each link is, seen from its parent, as the encoders and the kinematics of the body say (profile
// event, only while somebody is connected). Joints that no board has stay at zero. Node and boards must
// outlive the server. Fails as RobotModel::load and opening the port do.
Result<std::unique_ptr<IServer>> serve_body(Node& node, const std::filesystem::path& urdf,
                                            std::vector<const IControlBoard*> boards, std::int64_t period_ns);

}  // namespace nido
