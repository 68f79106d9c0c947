#include "nido/report/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace nido {
namespace {

TEST(Statistics, WilsonKnownValues) {
  // worked example: 15 of 20
  const auto interval = wilson_interval(15, 20);
  EXPECT_NEAR(interval[0], 0.5313, 5e-4);
  EXPECT_NEAR(interval[1], 0.8881, 5e-4);
  EXPECT_NEAR(wilson_interval(0, 10)[0], 0.0, 1e-12);
  EXPECT_NEAR(wilson_interval(10, 10)[1], 1.0, 1e-12);
  EXPECT_EQ(wilson_interval(0, 0), (std::array<double, 2>{0.0, 1.0}));
}

TEST(Statistics, QuantilesOfAKnownSet) {
  EXPECT_DOUBLE_EQ(median({3, 1, 2}), 2.0);
  EXPECT_DOUBLE_EQ(median({4, 1, 2, 3}), 2.5);
  EXPECT_DOUBLE_EQ(quantile({0, 10}, 0.95), 9.5);
  EXPECT_TRUE(std::isnan(median({})));
}

// intervals must hold the truth about as often as they promise
TEST(Statistics, IntervalsCoverTheTruth) {
  std::mt19937_64 generator(3);
  const auto uniform = [&] { return static_cast<double>(generator() >> 11U) * 0x1p-53; };
  int mean_hits = 0;
  int median_hits = 0;
  int wilson_hits = 0;
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<double> samples(20);
    int successes = 0;
    for (auto& sample : samples) {
      sample = uniform();
      successes += uniform() < 0.8 ? 1 : 0;
    }
    const auto holds = [](const std::array<double, 2>& interval, double truth) {
      return interval[0] <= truth && truth <= interval[1] ? 1 : 0;
    };
    mean_hits += holds(mean_interval(samples), 0.5);
    median_hits += holds(median_interval(samples), 0.5);
    wilson_hits += holds(wilson_interval(successes, 20), 0.8);
  }
  EXPECT_NEAR(mean_hits, 0.95 * kRuns, 0.02 * kRuns);
  EXPECT_GE(median_hits, 0.94 * kRuns);
  EXPECT_GE(wilson_hits, 0.92 * kRuns);
}

}  // namespace
}  // namespace nido
