#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "nido/interfaces/audio.h"
#include "nido/interfaces/camera.h"
#include "nido/interfaces/control_board.h"
#include "nido/interfaces/inertial.h"
#include "nido/interfaces/touch.h"
#include "nido/interfaces/world.h"
#include "nido/middleware/node.h"
#include "nido/wrappers/server.h"

namespace nido {

// Each function opens the ports of one kind of server under a stem such as "/icubSim/left_arm". They fail as
// opening the ports does. Node and device must outlive the server. Frames: `frame_id` goes into the messages'
// headers.

// STEM/rpc:i (text), STEM/command:i JointCommand (profile command), STEM/state:o JointState (profile state).
Result<std::unique_ptr<IServer>> serve_control_board(Node& node, const std::string& stem,
                                                     IControlBoard& board, std::int64_t period_ns);

// How a camera is served.
struct CameraServing {
  std::int64_t period_ns = 33'333'333;
  // Time between a picture's taking and its publication, as real cameras have it, for cameras with a shutter;
  // others publish what they see at once. Shorter than the period. The stamp is that of the taking. The first
  // picture is published at once if first_at_once: somebody may wait for it.
  std::int64_t latency_ns = 0;
  std::string frame_id{};
  bool on_demand = false;  // only while somebody is connected
  bool first_at_once = true;
};

// STEM/image:o Image rgb8 (profile sensor), STEM/camera_info:o CameraInfo (profile state), both at the same
// times.
Result<std::unique_ptr<IServer>> serve_camera(Node& node, const std::string& stem, ICamera& camera,
                                              const CameraServing& serving);

struct TouchServing {
  std::int64_t period_ns = 0;
  std::string frame_id{};
  bool on_demand = false;  // published only while somebody reads
};

// STEM:o Touch (profile state).
Result<std::unique_ptr<IServer>> serve_touch(Node& node, const std::string& stem, ITouch& touch,
                                             const TouchServing& serving);

// STEM:o Audio (profile event) in pieces of a period. Starts the device.
Result<std::unique_ptr<IServer>> serve_audio(Node& node, const std::string& stem, IAudioGrabberSound& audio,
                                             std::int64_t period_ns, const std::string& frame_id);

// STEM:i Audio (profile event): what comes is played. Starts the device. What the device refuses is logged.
Result<std::unique_ptr<IServer>> serve_speaker(Node& node, const std::string& stem, IAudioRender& speaker);

// STEM:o WrenchStamped (profile state).
Result<std::unique_ptr<IServer>> serve_force_torque(Node& node, const std::string& stem, IForceTorque& sensor,
                                                    std::int64_t period_ns, const std::string& frame_id);

// STEM:o Imu (profile state).
Result<std::unique_ptr<IServer>> serve_inertial(Node& node, const std::string& stem, IInertial& sensor,
                                                std::int64_t period_ns, const std::string& frame_id);

// STEM, a text service. Answers on a thread of the middleware.
Result<std::unique_ptr<IServer>> serve_world(Node& node, const std::string& stem, IWorld& world);

}  // namespace nido
