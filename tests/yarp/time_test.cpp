// The far side's time as ours.

#include <gtest/gtest.h>

#include "remote_stamps.h"

namespace nido::yarp {
namespace {

constexpr std::int64_t kTick_ns = 10'000'000;
constexpr std::int64_t kSecond_ns = 1'000'000'000;

// a clock of the far side that stands at 100 s when ours begins
FollowedTime started_at_hundred() {
  FollowedTime time;
  time.to_own(100 * kSecond_ns, 0);
  time.start(0);
  return time;
}

TEST(FollowedTime, OneOffsetForAllStampsWheneverTheyCome) {
  FollowedTime time = started_at_hundred();
  EXPECT_EQ(time.to_own(100 * kSecond_ns + 7 * kTick_ns, 0), 7 * kTick_ns);
  EXPECT_EQ(time.newest_own_ns(), 7 * kTick_ns);
  // a picture that took long
  EXPECT_EQ(time.to_own(100 * kSecond_ns + 3 * kTick_ns, 9 * kTick_ns), 3 * kTick_ns);
  EXPECT_EQ(time.newest_own_ns(), 7 * kTick_ns);
}

TEST(FollowedTime, StartsWithTheFirstStampWhenItComesLater) {
  FollowedTime time;
  time.start(0);
  EXPECT_EQ(time.to_own(100 * kSecond_ns, 4 * kTick_ns), 4 * kTick_ns);
}

TEST(FollowedTime, GoesOnWhenTheFarSideStartsAgain) {
  FollowedTime time = started_at_hundred();
  const std::int64_t now_ns = 5 * kTick_ns;
  std::int64_t last_ns = 0;
  for (int tick = 1; tick <= 100; ++tick) last_ns = time.to_own(tick * kTick_ns, now_ns);
  EXPECT_GE(last_ns, now_ns);
  EXPECT_LE(last_ns, now_ns + 100 * kTick_ns);
  EXPECT_EQ(time.to_own(101 * kTick_ns, now_ns) - last_ns, kTick_ns);
}

TEST(FollowedTime, OneWrongStampChangesNothing) {
  FollowedTime time = started_at_hundred();
  EXPECT_EQ(time.to_own(4'000'000 * kSecond_ns, 2 * kTick_ns), 2 * kTick_ns);
  EXPECT_EQ(time.to_own(100 * kSecond_ns + 3 * kTick_ns, 3 * kTick_ns), 3 * kTick_ns);
}

TEST(FollowedTime, KeepsItsOffsetOverAGapThatBothSidesLivedThrough) {
  FollowedTime time = started_at_hundred();
  const std::int64_t gap_ns = 7 * kSecond_ns;
  for (int tick = 0; tick < 40; ++tick) {
    time.to_own(100 * kSecond_ns + gap_ns + tick * kTick_ns, gap_ns + tick * kTick_ns);
  }
  EXPECT_EQ(time.to_own(100 * kSecond_ns + gap_ns + 40 * kTick_ns, 0), gap_ns + 40 * kTick_ns);
}

TEST(ClockOffset, AFarSideThatStartsAgainIsNoOlderThanItIs) {
  ClockOffset offset;
  std::int64_t now_ns = 1000 * kSecond_ns;
  for (int tick = 1; tick <= 100; ++tick) {
    now_ns += kTick_ns;
    EXPECT_EQ(offset.to_own(60 * kSecond_ns + tick * kTick_ns, now_ns), now_ns);
  }
  now_ns += 9 * kSecond_ns;
  for (int tick = 0; tick <= 100; ++tick) {
    now_ns += kTick_ns;
    EXPECT_EQ(offset.to_own(tick * kTick_ns, now_ns), now_ns) << tick;
  }
}

}  // namespace
}  // namespace nido::yarp
