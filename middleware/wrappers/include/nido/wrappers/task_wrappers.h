#pragma once

#include <memory>
#include <string>

#include "nido/interfaces/frame_transforms.h"
#include "nido/interfaces/task_control.h"
#include "nido/wrappers/clients.h"
#include "nido/wrappers/server.h"

namespace nido {

// Control of hand and gaze, and frames, over the network: the text service STEM/rpc:i (docs/task_control.md,
// docs/frames.md). Node and
// device must outlive server and client; thread-safety, failures and time limits are those of servers.h and
// clients.h.
Result<std::unique_ptr<IServer>> serve_cartesian(Node& node, const std::string& stem,
                                                 ICartesianControl& hand);
Result<std::unique_ptr<IServer>> serve_gaze(Node& node, const std::string& stem, IGazeControl& gaze);
Result<std::unique_ptr<IServer>> serve_frames(Node& node, const std::string& stem, IFrameTransforms& frames);

// `local` is not used. kNotFound when nobody answers at the remote stem.
Result<std::unique_ptr<ICartesianControl>> cartesian_client(Node& node, const ClientOptions& options);
Result<std::unique_ptr<IGazeControl>> gaze_client(Node& node, const ClientOptions& options);
Result<std::unique_ptr<IFrameTransforms>> frames_client(Node& node, const ClientOptions& options);

}  // namespace nido
