// Audio devices: clips, noise, synthesis.

#include <gtest/gtest.h>
#include <sndfile.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "audio/clip.h"
#include "audio/clip_audio.h"
#include "audio/room_speaker.h"
#include "nido/interfaces/clock.h"
#include "speaker_contract.h"

namespace nido::test {
namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;

Clip tone(double frequency_hz, int rate_hz, double duration_s, double amplitude) {
  Clip clip{rate_hz, {}};
  for (int i = 0; i < static_cast<int>(duration_s * rate_hz); ++i) {
    clip.samples.push_back(
        static_cast<float>(amplitude * std::sin(2 * std::numbers::pi * frequency_hz * i / rate_hz)));
  }
  return clip;
}

double rms(const std::vector<std::int16_t>& samples, std::size_t begin, std::size_t end) {
  double sum = 0;
  for (std::size_t i = begin; i < end; ++i) sum += static_cast<double>(samples[i]) * samples[i];
  return std::sqrt(sum / static_cast<double>(end - begin)) / 32767;
}

// Everything that is heard in a time, in pieces of 20 ms.
std::vector<std::int16_t> listen(ClipAudio& audio, ManualClock& clock, int pieces) {
  std::vector<std::int16_t> heard;
  for (int i = 0; i < pieces; ++i) {
    clock.advance_ns(20 * kMillisecond_ns);
    const Sound sound = *audio.get_sound(320);
    EXPECT_EQ(sound.frames(), 320U);
    EXPECT_EQ(sound.stamp_ns, i * 20 * kMillisecond_ns);
    heard.insert(heard.end(), sound.samples.begin(), sound.samples.end());
  }
  return heard;
}

TEST(ClipAudio, PlaysTheClipAtItsTimeOverALowNoise) {
  ManualClock clock;
  ClipAudio audio(tone(440, 16000, 0.5, 0.5), {.start_s = 0.5, .noise_db = -55}, clock);
  ASSERT_TRUE(audio.start().ok());
  const std::vector<std::int16_t> heard = listen(audio, clock, 75);
  EXPECT_NEAR(20 * std::log10(rms(heard, 0, 8000)), -55, 3);
  EXPECT_NEAR(rms(heard, 8000, 16000), 0.5 / std::numbers::sqrt2, 0.01);
  EXPECT_NEAR(20 * std::log10(rms(heard, 16000, 24000)), -55, 3);
}

TEST(ClipAudio, TheSameSeedGivesTheSameSamples) {
  const auto run = [](std::uint64_t seed) {
    ManualClock clock;
    ClipAudio audio(tone(300, 22050, 0.2, 0.3), {.start_s = 0.1, .seed = seed}, clock);
    EXPECT_TRUE(audio.start().ok());
    return listen(audio, clock, 20);
  };
  EXPECT_EQ(run(4), run(4));
  EXPECT_NE(run(4), run(5));
}

TEST(ClipAudio, GivesNothingBeforeTimePassesAndFailsWhenNotStarted) {
  ManualClock clock;
  ClipAudio audio({}, {}, clock);
  EXPECT_FALSE(audio.get_sound(320).ok());
  ASSERT_TRUE(audio.start().ok());
  EXPECT_EQ(audio.get_sound(320)->frames(), 0U);
  clock.advance_ns(kMillisecond_ns);
  EXPECT_EQ(audio.get_sound(320)->frames(), 16U);
}

TEST(Resample, KeepsAToneBelowTheNewLimitAndDropsOneAbove) {
  const Clip low = resample(tone(1000, 22050, 0.5, 0.5), 16000);
  EXPECT_EQ(low.sample_rate_hz, 16000);
  EXPECT_NEAR(static_cast<double>(low.samples.size()), 8000, 2);
  double error = 0;
  for (std::size_t i = 500; i < 7500; ++i) {
    const double expected = 0.5 * std::sin(2 * std::numbers::pi * 1000 * static_cast<double>(i) / 16000);
    error = std::max(error, std::abs(static_cast<double>(low.samples[i]) - expected));
  }
  EXPECT_LT(error, 0.01);
  const Clip high = resample(tone(10000, 22050, 0.5, 0.5), 16000);
  for (std::size_t i = 500; i < 7500; ++i) ASSERT_LT(std::abs(high.samples[i]), 0.02) << i;
}

class SoundFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "nido-audio-test-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

class RoomSpeakerRig final : public SpeakerRig {
 public:
  IAudioRender& speaker() override { return speaker_; }
  void advance() override { clock_.advance_ns(10 * kMillisecond_ns); }
  double waiting_s() override { return speaker_.waiting_s(); }

 private:
  ManualClock clock_;
  RoomSpeaker speaker_{"", 16000, clock_};
};
INSTANTIATE_TEST_SUITE_P(Room, SpeakerContract,
                         testing::Values([] { return std::make_unique<RoomSpeakerRig>(); }));

TEST_F(SoundFile, TheSpeakersFileHasEverySoundAtItsTime) {
  const std::filesystem::path path = folder_ / "said.wav";
  ManualClock clock;
  {
    RoomSpeaker speaker(path, 16000, clock);
    ASSERT_TRUE(speaker.start().ok());
    EXPECT_FALSE(std::filesystem::exists(path)) << "nothing was said yet";
    clock.advance_ns(1000 * kMillisecond_ns);
    const Sound sound{0, 16000, 1, std::vector<std::int16_t>(8000, 8192)};
    ASSERT_TRUE(speaker.render(sound).ok());
    ASSERT_TRUE(speaker.render({0, 8000, 2, std::vector<std::int16_t>(8000, 4096)}).ok());
    clock.advance_ns(1750 * kMillisecond_ns);
    ASSERT_TRUE(speaker.render(sound).ok());
    clock.advance_ns(250 * kMillisecond_ns);
    ASSERT_TRUE(speaker.stop().ok());  // in the middle of the last one
  }
  const Clip clip = *read_sound_file(path);
  EXPECT_EQ(clip.sample_rate_hz, 16000);
  ASSERT_EQ(clip.samples.size(), 48000U);
  for (const auto& [index, value] : {std::pair{8000, 0.0},
                                     {16100, 0.25},
                                     {23900, 0.25},
                                     {28000, 0.125},
                                     {40000, 0.0},
                                     {44100, 0.25},
                                     {47999, 0.25}}) {
    EXPECT_NEAR(clip.samples[static_cast<std::size_t>(index)], value, 0.005) << index;
  }
}

TEST_F(SoundFile, ASpeakerThatCannotWriteSaysSoAndOneWithTooMuchToSayRefuses) {
  ManualClock clock;
  RoomSpeaker lost(folder_ / "none" / "said.wav", 16000, clock);
  ASSERT_TRUE(lost.start().ok());
  const Sound ten_seconds{0, 16000, 1, std::vector<std::int16_t>(160000, 1)};
  const Status failed = lost.render(ten_seconds);
  ASSERT_FALSE(failed.ok());
  EXPECT_NE(failed.error().message.find("said.wav"), std::string::npos);
  RoomSpeaker speaker("", 16000, clock);
  ASSERT_TRUE(speaker.start().ok());
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(speaker.render(ten_seconds).ok());
  EXPECT_FALSE(speaker.render(ten_seconds).ok());
  EXPECT_NEAR(speaker.waiting_s(), 30.0, 1e-9);
}

TEST_F(SoundFile, ChannelsAreAveraged) {
  const std::filesystem::path path = folder_ / "stereo.wav";
  SF_INFO info{};
  info.samplerate = 8000;
  info.channels = 2;
  info.format = SF_FORMAT_WAV | SF_FORMAT_FLOAT;
  SNDFILE* file = sf_open(path.c_str(), SFM_WRITE, &info);
  const float frames[] = {0.2F, 0.4F, -0.5F, 0.5F};
  sf_writef_float(file, frames, 2);
  sf_close(file);
  const Clip clip = *read_sound_file(path);
  EXPECT_EQ(clip.sample_rate_hz, 8000);
  ASSERT_EQ(clip.samples.size(), 2U);
  EXPECT_NEAR(clip.samples[0], 0.3, 1e-6);
  EXPECT_NEAR(clip.samples[1], 0.0, 1e-6);
}

TEST_F(SoundFile, WhatIsNoSoundIsRefusedInWords) {
  const auto missing = read_sound_file(folder_ / "none.wav");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_NE(missing.error().message.find("none.wav"), std::string::npos);
  const std::filesystem::path path = folder_ / "text.wav";
  std::ofstream(path) << "this is no sound";
  const auto refused = read_sound_file(path);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
}

TEST(SynthesiseSpeech, SaysSomethingOfAPlausibleLength) {
  const auto clip = synthesise_speech("drop blue cube into basket", "en-us");
  ASSERT_TRUE(clip.ok()) << clip.error().message;
  const double duration_s = static_cast<double>(clip->samples.size()) / clip->sample_rate_hz;
  EXPECT_GT(duration_s, 0.8);
  EXPECT_LT(duration_s, 6.0);
  float peak = 0;
  for (const float sample : clip->samples) peak = std::max(peak, std::abs(sample));
  EXPECT_NEAR(peak, 0.708, 0.01);
}

TEST(SynthesiseSpeech, TextIsNeverTakenForAnOption) {
  EXPECT_TRUE(synthesise_speech("--version", "en-us").ok());
  EXPECT_TRUE(synthesise_speech("; touch /tmp/no $(touch /tmp/no)", "en-us").ok());
}

TEST(SynthesiseSpeech, NamesAVoiceThatDoesNotExist) {
  const auto clip = synthesise_speech("hello", "klingon-opera");
  ASSERT_FALSE(clip.ok());
  EXPECT_NE(clip.error().message.find("klingon-opera"), std::string::npos) << clip.error().message;
  EXPECT_FALSE(synthesise_speech("", "en-us").ok());
}

}  // namespace
}  // namespace nido::test
