// Somebody speaks to the robot while it listens.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "audio/clip_audio.h"

namespace nido {
namespace {

class ManualClock final : public IClock {
 public:
  [[nodiscard]] std::int64_t now_ns() const override { return now_ns_; }
  void advance(double seconds) { now_ns_ += std::llround(seconds * 1e9); }

 private:
  std::int64_t now_ns_ = 5'000'000'000;
};

// The next seconds of what is heard: the loudest sample of each tenth.
std::vector<int> loudness(ClipAudio& ears, ManualClock& clock, double seconds) {
  std::vector<int> tenths;
  for (double past = 0; past < seconds - 0.05; past += 0.1) {
    clock.advance(0.1);
    const auto sound = ears.get_sound(100'000);
    int loudest = 0;
    for (const int sample : sound->samples) loudest = std::max(loudest, std::abs(sample));
    tenths.push_back(loudest);
  }
  return tenths;
}

TEST(SpokenTo, IsHeardFromTheMomentThatWasTold) {
  ManualClock clock;
  ClipAudio ears({}, {.noise_db = -60}, clock);
  ASSERT_TRUE(ears.start());
  const auto before = loudness(ears, clock, 1);
  EXPECT_LT(*std::max_element(before.begin(), before.end()), 500);
  const auto begin_s = ears.say("grasp red ball");
  ASSERT_TRUE(begin_s) << begin_s.error().message;
  EXPECT_NEAR(*begin_s, 6.0, 1e-3);
  const auto during = loudness(ears, clock, 1);
  EXPECT_GT(*std::max_element(during.begin(), during.end()), 10'000);
  const auto after = loudness(ears, clock, 3);
  EXPECT_LT(after.back(), 500);
}

TEST(SpokenTo, OneIsSaidAfterAnotherWithAPause) {
  ManualClock clock;
  ClipAudio ears({}, {.noise_db = -60}, clock);
  ASSERT_TRUE(ears.start());
  const auto first_s = ears.say("stop");
  const auto second_s = ears.say("stop");
  ASSERT_TRUE(first_s);
  ASSERT_TRUE(second_s);
  EXPECT_GT(*second_s, *first_s + 1.2);
  EXPECT_LT(*second_s, *first_s + 3);
  const auto heard = loudness(ears, clock, *second_s - *first_s + 1);
  const auto pause = static_cast<std::size_t>((*second_s - *first_s) * 10) - 4;
  EXPECT_LT(heard[pause], 500);
  EXPECT_GT(*std::max_element(heard.begin() + static_cast<std::ptrdiff_t>(pause), heard.end()), 10'000);
}

TEST(SpokenTo, WhatCannotBeSaidIsRefused) {
  ManualClock clock;
  ClipAudio ears({}, {}, clock);
  EXPECT_FALSE(ears.say("nobody listens yet"));
  ASSERT_TRUE(ears.start());
  EXPECT_EQ(ears.say("").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(ears.say(std::string(201, 'x')).error().code, ErrorCode::kInvalidArgument);
  bool refused = false;
  for (int i = 0; i < 100 && !refused; ++i)
    refused = !ears.say("a rather long sentence that fills a minute soon");
  EXPECT_TRUE(refused);
}

}  // namespace
}  // namespace nido
