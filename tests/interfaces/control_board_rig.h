#pragma once

#include "nido/interfaces/control_board.h"

namespace nido::test {

// A board and the means to let its time pass.
class ControlBoardRig {
 public:
  virtual ~ControlBoardRig() = default;
  virtual IControlBoard& board() = 0;
  // Lets 10 ms of the robot's time pass; what was measured at its end can be read afterwards.
  virtual void advance() = 0;
  // A joint that nothing hinders from moving through the middle of its range.
  virtual int free_joint() = 0;
  // How near a position is held, in rad.
  virtual double tolerance_rad() { return 0.02; }
  // False where streamed commands and orders travel on connections of their own, as with YARP: what was
  // streamed just before an order may be taken after it, until the command's time limit ends it.
  virtual bool keeps_order() { return true; }
};

}  // namespace nido::test
