#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// A piece of sound, 16 bit, channels interleaved.
struct Sound {
  std::int64_t stamp_ns = 0;  // when the first sample was heard, of the robot's clock
  int sample_rate_hz = 0;
  int channels = 0;
  std::vector<std::int16_t> samples;
  // Samples of each channel.
  [[nodiscard]] std::size_t frames() const {
    return channels > 0 ? samples.size() / static_cast<std::size_t>(channels) : 0;
  }
};

// kInvalidArgument, with what was found, unless the sound has a rate from 8000 to 48000 Hz, one or two
// channels, and samples that fill them.
inline Status check_sound(const Sound& sound) {
  const auto wrong = [](const std::string& sentence) { return Error{ErrorCode::kInvalidArgument, sentence}; };
  if (sound.sample_rate_hz < 8000 || sound.sample_rate_hz > 48000) {
    return wrong("the sound has " + std::to_string(sound.sample_rate_hz) +
                 " samples a second; allowed are 8000 to 48000");
  }
  if (sound.channels != 1 && sound.channels != 2) {
    return wrong("the sound has " + std::to_string(sound.channels) + " channels; allowed are 1 and 2");
  }
  if (sound.samples.size() % static_cast<std::size_t>(sound.channels) != 0) {
    return wrong(std::to_string(sound.samples.size()) + " samples do not fill " +
                 std::to_string(sound.channels) + " channels");
  }
  return {};
}

// Something that hears. Thread-safe.
class IAudioGrabberSound {
 public:
  virtual ~IAudioGrabberSound() = default;
  [[nodiscard]] virtual int sample_rate_hz() const = 0;
  [[nodiscard]] virtual int channels() const = 0;
  // Begins to listen. Starting twice is no error.
  virtual Status start() = 0;
  // Stops to listen and forgets what was not taken.
  virtual Status stop() = 0;
  // What was heard since the last call, oldest first, at most `max_frames` samples a channel; empty when
  // nothing is there yet. kFailed when not started.
  virtual Result<Sound> get_sound(std::size_t max_frames) = 0;
};

// Something that makes sounds. Thread-safe.
class IAudioRender {
 public:
  virtual ~IAudioRender() = default;
  // Begins to play what comes. Starting twice is no error.
  virtual Status start() = 0;
  // Falls silent and forgets what waits.
  virtual Status stop() = 0;
  // Plays a sound after those that wait already; does not block. The stamp is not used. kFailed when not
  // started, or when more than half a minute would wait; otherwise as check_sound(); refused, it changes
  // nothing.
  virtual Status render(const Sound& sound) = 0;
};

}  // namespace nido
