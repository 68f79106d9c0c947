#pragma once

#include <functional>
#include <memory>
#include <string>

#include "nido/interfaces/frame_transforms.h"
#include "nido/interfaces/task_control.h"

namespace nido {

// Control of hand and gaze, and frames, by lines of text. docs/task_control.md and docs/frames.md have every
// line and its answer. Metres, degrees, quaternions x y z w. A refused line changes nothing and is answered
// [fail] "reason". Thread-safe as the device is.
//
//     go -0.25 0.15 0.05 0.5 0.5 0.5 0.5 in 2     hand to a pose; without the quaternion to a place
//     get state      -> [is] state TIME MOVING (X Y Z QX QY QZ QW) ... [ok]
[[nodiscard]] std::string cartesian_reply(ICartesianControl& hand, const std::string& line);
//     look at -0.4 0.1 0.0
//     look pixel left 120 80 0.5     at what is seen there, 0.5 m away
[[nodiscard]] std::string gaze_reply(IGazeControl& gaze, const std::string& line);
//     get transform root_link r_hand    -> [is] transform TIME (X Y Z QX QY QZ QW) [ok]
//     put root_link marker -0.4 0.1 0.05 0 0 0 1
[[nodiscard]] std::string frames_reply(IFrameTransforms& frames, const std::string& line);

// A device on the far side of whatever carries a line there and its answer back. kFailed with the far side's
// reason for what it refuses.
using AskLine = std::function<Result<std::string>(const std::string& line)>;
[[nodiscard]] std::unique_ptr<ICartesianControl> asked_cartesian(AskLine ask);
[[nodiscard]] std::unique_ptr<IGazeControl> asked_gaze(AskLine ask);
[[nodiscard]] std::unique_ptr<IFrameTransforms> asked_frames(AskLine ask);

}  // namespace nido
