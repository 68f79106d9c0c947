#pragma once

#include <memory>
#include <string>

#include "nido/interfaces/audio.h"
#include "nido/interfaces/camera.h"
#include "nido/interfaces/control_board.h"
#include "nido/interfaces/touch.h"
#include "nido/interfaces/world.h"
#include "nido/middleware/node.h"

namespace nido {

// How a client finds its server.
struct ClientOptions {
  std::string remote;      // stem of the server's ports: "/icubSim/left_arm"
  std::string local;       // stem of the client's own ports: "/mine/left_arm"
  double timeout_s = 2.0;  // wall time to wait for the server, and for each answer
};

// Each function makes a device that is the far side of one on the network. They fail with kNotFound when
// nobody serves the remote stem within the time. The node must outlive the device. Devices are thread-safe.

// State comes from STEM/state:o (no accelerations: zero), streams go to STEM/command:i, the rest is asked by
// STEM/rpc:i and waits for the answer.
Result<std::unique_ptr<IControlBoard>> control_board_client(Node& node, const ClientOptions& options);
Result<std::unique_ptr<ICamera>> camera_client(Node& node, const ClientOptions& options);
// Six pads of a hand; as many as the far side has of a patch of skin.
Result<std::unique_ptr<ITouch>> touch_client(Node& node, const ClientOptions& options, int pads = 6);
// start() and stop() begin and end to keep what comes; the server goes on.
Result<std::unique_ptr<IAudioGrabberSound>> audio_client(Node& node, const ClientOptions& options);
// A sound that the far side refuses is in its log; what is refused here never leaves.
Result<std::unique_ptr<IAudioRender>> speaker_client(Node& node, const ClientOptions& options);
// `local` is not used.
Result<std::unique_ptr<IWorld>> world_client(Node& node, const ClientOptions& options);

}  // namespace nido
