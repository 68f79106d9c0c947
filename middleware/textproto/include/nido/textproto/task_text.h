#pragma once

#include <functional>
#include <memory>
#include <string>

#include "nido/interfaces/task_control.h"

namespace nido {

// Control of hand and gaze by lines of text (docs/task_control.md). Metres, degrees at joints, quaternions
// x y z w. A refused line changes nothing and is answered [fail] "reason". Thread-safe as the device is.
//
//     go -0.25 0.15 0.05 0.5 0.5 0.5 0.5 in 2     hand to a pose; without the quaternion to a place
//     plan -0.25 0.15 0.05      -> [is] plan (12.5 ...) 0.0003 0.12 [ok]     degrees; m and degrees that are
//     left get state                 -> [is] state TIME MOVING (X Y Z QX QY QZ QW) OFF_M OFF_DEG [ok] stop
[[nodiscard]] std::string cartesian_reply(ICartesianControl& hand, const std::string& line);
//     look at -0.4 0.1 0.0
//     look pixel left 120 80 0.5     at what is seen there, 0.5 m away
//     look pixels 120 80 112 80      at what is seen at one place in the left picture, another in the right
//     one look angles abs 10 -5 4        azimuth, elevation, vergence, degrees; rel: from where the eyes look
//     now get state   -> [is] state TIME MOVING (X Y Z) OFF_PX (AZIMUTH ELEVATION VERGENCE) (TORSO x 3) (HEAD
//     x 6)
//                    (LEFT EYE x 7) (RIGHT EYE x 7) [ok]     where the eyes meet; degrees; poses as above
//     stop
[[nodiscard]] std::string gaze_reply(IGazeControl& gaze, const std::string& line);

// A device on the far side of whatever carries a line there and its answer back. kFailed with the far side's
// reason for what it refuses.
using AskLine = std::function<Result<std::string>(const std::string& line)>;
[[nodiscard]] std::unique_ptr<ICartesianControl> asked_cartesian(AskLine ask);
[[nodiscard]] std::unique_ptr<IGazeControl> asked_gaze(AskLine ask);

}  // namespace nido
