#include <gtest/gtest.h>

#include <vector>

#include "nido/wrappers/server.h"

namespace nido::test {
namespace {

constexpr std::int64_t kTick_ns = 10'000'000;

TEST(Due, DoesNotDriftWhenThePeriodIsNoMultipleOfTheTick) {
  Due due(33'333'333);
  int count = 0;
  for (int tick = 0; tick <= 1000; ++tick) count += due.at(tick * kTick_ns) ? 1 : 0;
  EXPECT_EQ(count, 301);
}

TEST(Due, StartsAtTheFirstCallAndSkipsWhatWasMissed) {
  Due due(kTick_ns);
  EXPECT_TRUE(due.at(5));
  EXPECT_FALSE(due.at(6));
  EXPECT_TRUE(due.at(5 + 10 * kTick_ns));
  EXPECT_FALSE(due.at(6 + 10 * kTick_ns));
}

}  // namespace
}  // namespace nido::test
