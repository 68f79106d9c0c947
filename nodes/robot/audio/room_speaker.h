#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include "nido/interfaces/audio.h"
#include "nido/interfaces/clock.h"

struct sf_private_tag;

namespace nido {

// A loudspeaker in a room where nobody listens but a recorder: what is played goes into a sound file, at its
// time of the robot's clock. Sounds of other rates are resampled, two channels are averaged. Thread-safe.
class RoomSpeaker final : public IAudioRender {
 public:
  // `clock` must outlive the device. The file begins now and is made when the first sound comes; without one,
  // what is played is gone.
  RoomSpeaker(std::filesystem::path file, int sample_rate_hz, const IClock& clock);

  Status start() override;
  Status stop() override;
  // Also kFailed when the file cannot be written.
  Status render(const Sound& sound) override;
  // What waits to be played or is being played, s of the robot's clock.
  [[nodiscard]] double waiting_s() const;

 private:
  struct CloseFile {
    void operator()(sf_private_tag* file) const;
  };
  [[nodiscard]] std::int64_t frames_until_now() const;
  Status write(const Sound& sound, std::int64_t begin, std::int64_t frames);

  const std::filesystem::path path_;
  const std::int64_t sample_rate_hz_;
  const IClock& clock_;
  const std::int64_t begin_ns_;  // of the file
  mutable std::mutex mutex_;
  std::unique_ptr<sf_private_tag, CloseFile> file_;
  bool started_ = false;
  std::int64_t written_ = 0;     // frames in the file
  std::int64_t ends_after_ = 0;  // frames after which the last sound ends
};

}  // namespace nido
