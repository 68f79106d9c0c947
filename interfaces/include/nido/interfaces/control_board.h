#pragma once

#include "nido/interfaces/motor_control.h"
#include "nido/interfaces/motors.h"

namespace nido {

// A control board: everything that one part's joints can be asked for. Simulated, real, fake, limited and
// far-away boards all are one.
class IControlBoard : public IAxisInfo,
                      public IEncodersTimed,
                      public IControlLimits,
                      public IControlMode,
                      public IPositionControl,
                      public IPositionDirect,
                      public IVelocityControl,
                      public ITorqueControl,
                      public IPwmControl,
                      public IMotors {};

}  // namespace nido
