#include <gtest/gtest.h>

#include <limits>

#include "nido/interfaces/audio.h"
#include "nido/interfaces/check_joints.h"
#include "nido/interfaces/clock.h"
#include "nido/interfaces/control_mode.h"

namespace nido {
namespace {

TEST(ControlModeWords, ComeBackAsTheSameMode) {
  for (const ControlMode mode :
       {ControlMode::kIdle, ControlMode::kPosition, ControlMode::kDirect, ControlMode::kVelocity,
        ControlMode::kTorque, ControlMode::kPwm, ControlMode::kFault}) {
    EXPECT_EQ(control_mode_from_string(to_string(mode)), mode);
  }
  EXPECT_FALSE(control_mode_from_string("pos"));
  EXPECT_FALSE(control_mode_from_string(""));
}

TEST(CheckJoints, NamesWhatIsWrong) {
  const int beyond[] = {3};
  const double one[] = {1.0};
  EXPECT_EQ(check_joint_values(3, beyond, one).error().message, "joint 3 does not exist: joints are 0..2");
  const int joints[] = {0, 1};
  EXPECT_EQ(check_joint_values(3, joints, one).error().message,
            "2 joints but 1 values: one a joint is expected");
  const int twice[] = {1, 1};
  const double two[] = {1.0, 2.0};
  EXPECT_EQ(check_joint_values(3, twice, two).error().message, "joint 1 is named twice");
  const int first[] = {0};
  const double nan[] = {std::numeric_limits<double>::quiet_NaN()};
  EXPECT_FALSE(check_joint_values(3, first, nan).ok());
  const double zero[] = {0.0};
  EXPECT_TRUE(check_joint_values(3, first, zero).ok());
  EXPECT_FALSE(check_joint_magnitudes(3, first, zero).ok());
}

TEST(Sound, CountsFramesOfAllChannels) {
  Sound sound;
  EXPECT_EQ(sound.frames(), 0U);
  sound.channels = 2;
  sound.samples = {1, 2, 3, 4};
  EXPECT_EQ(sound.frames(), 2U);
}

TEST(ManualClock, MovesOnlyWhenMoved) {
  ManualClock clock(5);
  clock.advance_ns(10);
  EXPECT_EQ(clock.now_ns(), 15);
  clock.set_ns(3);
  EXPECT_EQ(clock.now_ns(), 3);
}

}  // namespace
}  // namespace nido
