#pragma once

// The contract of loudspeakers, run unchanged against a device and against one through the network. Include
// it in one file of a test program and instantiate the suite with factories of rigs.

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "nido/interfaces/audio.h"

namespace nido::test {

// A loudspeaker, and what the device at the end of the line has to play.
class SpeakerRig {
 public:
  virtual ~SpeakerRig() = default;
  virtual IAudioRender& speaker() = 0;
  virtual void advance() = 0;
  [[nodiscard]] virtual double waiting_s() = 0;
};
using SpeakerRigFactory = std::function<std::unique_ptr<SpeakerRig>()>;

class SpeakerContract : public testing::TestWithParam<SpeakerRigFactory> {
 protected:
  void SetUp() override { rig_ = GetParam()(); }
  static Sound half_a_second() { return {0, 16000, 1, std::vector<std::int16_t>(8000, 100)}; }
  bool eventually_waits(double least_s, double most_s) {
    for (int period = 0; period < 400; ++period) {
      if (rig_->waiting_s() >= least_s && rig_->waiting_s() <= most_s) return true;
      rig_->advance();
    }
    return false;
  }
  std::unique_ptr<SpeakerRig> rig_;
};

TEST_P(SpeakerContract, PlaysNothingUnlessStarted) {
  const Status early = rig_->speaker().render(half_a_second());
  ASSERT_FALSE(early.ok());
  EXPECT_EQ(early.error().code, ErrorCode::kFailed);
  ASSERT_TRUE(rig_->speaker().start().ok());
  EXPECT_TRUE(rig_->speaker().start().ok());
  EXPECT_TRUE(rig_->speaker().render(half_a_second()).ok());
  ASSERT_TRUE(rig_->speaker().stop().ok());
  EXPECT_FALSE(rig_->speaker().render(half_a_second()).ok());
}

TEST_P(SpeakerContract, PlaysOneSoundAfterTheOtherAndThenIsSilent) {
  ASSERT_TRUE(rig_->speaker().start().ok());
  ASSERT_TRUE(rig_->speaker().render(half_a_second()).ok());
  ASSERT_TRUE(rig_->speaker().render(half_a_second()).ok());
  EXPECT_TRUE(eventually_waits(0.8, 1.0));
  EXPECT_TRUE(eventually_waits(0.0, 0.0));
}

TEST_P(SpeakerContract, TakesOtherRatesAndTwoChannels) {
  ASSERT_TRUE(rig_->speaker().start().ok());
  ASSERT_TRUE(rig_->speaker().render({0, 48000, 2, std::vector<std::int16_t>(96000, 100)}).ok());
  EXPECT_TRUE(eventually_waits(0.8, 1.0));
}

TEST_P(SpeakerContract, WhatIsNoSoundIsRefusedAndChangesNothing) {
  ASSERT_TRUE(rig_->speaker().start().ok());
  const std::vector<std::int16_t> some(4801, 100);
  for (const Sound& sound : {Sound{0, 0, 1, some}, Sound{0, 7999, 1, some}, Sound{0, 48001, 1, some},
                             Sound{0, 16000, 0, some}, Sound{0, 16000, 3, some}, Sound{0, 16000, 2, some}}) {
    const Status refused = rig_->speaker().render(sound);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  }
  rig_->advance();
  EXPECT_EQ(rig_->waiting_s(), 0.0);
}

}  // namespace nido::test
