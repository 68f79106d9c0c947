#pragma once

namespace nido::sim {

// What goes wrong on purpose ("world fault"), so that a node's behaviour under failure can be tested. Until
// the next reset.

enum class CameraFault {
  kNone,
  kStuck,  // shows the picture that it took first
  kOff,    // black
  kNoise,  // grain of 60 levels
  kSlow,   // a new picture only every fifth time
};

enum class JointFault {
  kNone,
  kWeak,   // a fifth of its torque is left
  kOff,    // no torque: the joint falls
  kStuck,  // the gear does not turn
};

enum class SkinFault {
  kNone,
  kStuck,  // a pad says what it said then
  kOff,    // says nothing
};

}  // namespace nido::sim
