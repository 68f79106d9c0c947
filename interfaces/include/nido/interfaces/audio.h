#pragma once

#include <cstddef>
#include <cstdint>
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

}  // namespace nido
