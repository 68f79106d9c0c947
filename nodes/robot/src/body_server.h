#pragma once

#include <memory>

#include "nido/middleware/node.h"
#include "nido/wrappers/server.h"
#include "task/body_frames.h"

namespace nido {

// /tf: where each frame is, seen from its parent (profile event, only while somebody is connected). Node and
// frames must outlive the server. Fails as opening the port does.
Result<std::unique_ptr<IServer>> serve_body(Node& node, const BodyFrames& frames, std::int64_t period_ns);

}  // namespace nido
