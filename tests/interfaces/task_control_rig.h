#pragma once

#include "nido/interfaces/frame_transforms.h"
#include "nido/interfaces/task_control.h"

namespace nido::test {

// A hand, a gaze and the frames of one robot, and the means to let its time pass.
class TaskRig {
 public:
  virtual ~TaskRig() = default;
  virtual ICartesianControl& hand() = 0;
  virtual IGazeControl& gaze() = 0;
  virtual IFrameTransforms& frames() = 0;
  // Lets 10 ms of the robot's time pass.
  virtual void advance() = 0;
  // How near bodies with mass come to what is asked for.
  virtual double tolerance_m() { return 0.002; }
  virtual double tolerance_px() { return 3; }
};

}  // namespace nido::test
