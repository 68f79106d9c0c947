#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "audio/clip.h"
#include "nido/interfaces/audio.h"
#include "nido/interfaces/clock.h"
#include "nido/interfaces/spoken_to.h"

namespace nido {

struct ClipAudioOptions {
  int sample_rate_hz = 16000;
  double start_s = 0;     // when the clip begins, after start(), s of the robot's clock
  double noise_db = -55;  // of the room's noise (pink), rms below full scale; digital silence is no real room
  std::uint64_t seed = 1;       // of the noise
  std::string voice = "en-us";  // espeak-ng's, of what is said while the robot listens
};

// A microphone in a room where a clip is played once, at a given time of the robot's clock, over a low noise.
// The same seed and clip give the same samples, as long as nobody speaks in the middle. Thread-safe.
class ClipAudio final : public IAudioGrabberSound, public ISpokenTo {
 public:
  // `clock` must outlive the device. An empty clip gives the room alone.
  ClipAudio(const Clip& clip, ClipAudioOptions options, const IClock& clock);

  [[nodiscard]] int sample_rate_hz() const override { return options_.sample_rate_hz; }
  [[nodiscard]] int channels() const override { return 1; }
  Status start() override;
  Status stop() override;
  Result<Sound> get_sound(std::size_t max_frames) override;
  Result<double> say(const std::string& text) override;

 private:
  // Something that is heard from a frame on.
  struct Spoken {
    std::int64_t begin = 0;
    std::vector<float> samples;
    [[nodiscard]] std::int64_t end() const { return begin + static_cast<std::int64_t>(samples.size()); }
  };
  float pink_noise();
  [[nodiscard]] std::int64_t heard_frames() const;

  const ClipAudioOptions options_;
  const IClock& clock_;
  std::mutex mutex_;
  std::vector<Spoken> spoken_;  // in the order of their beginnings
  bool started_ = false;
  std::int64_t started_ns_ = 0;
  std::int64_t taken_ = 0;  // frames since started_ns_
  std::uint64_t random_;
  double low_ = 0;  // states of the filters that make white noise pink
  double middle_ = 0;
  double high_ = 0;
};

}  // namespace nido
