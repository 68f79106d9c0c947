#include "audio/clip_audio.h"

#include <algorithm>
#include <cmath>

namespace nido {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
// rms of pink_noise() before it is scaled, for white noise that is even in -1..1
constexpr double kPinkRms = 1.72;

}  // namespace

ClipAudio::ClipAudio(const Clip& clip, ClipAudioOptions options, const IClock& clock)
    : options_(options),
      clock_(clock),
      spoken_{{static_cast<std::int64_t>(std::llround(options.start_s * options.sample_rate_hz)),
               resample(clip, options.sample_rate_hz).samples}},
      random_(options.seed * 0x9E3779B97F4A7C15U + 1) {}

std::int64_t ClipAudio::heard_frames() const {
  return (clock_.now_ns() - started_ns_) * options_.sample_rate_hz / kSecond_ns;
}

Result<double> ClipAudio::say(const std::string& text) {
  constexpr std::size_t kLongest = 200;
  constexpr std::int64_t kPause_s = 1;
  constexpr std::int64_t kMostWaiting_s = 20;
  if (text.empty() || text.size() > kLongest) {
    return Error{ErrorCode::kInvalidArgument,
                 "a text of " + std::to_string(text.size()) + " characters: 1 to 200 can be said"};
  }
  const Result<Clip> clip = synthesise_speech(text, options_.voice);
  if (!clip) return clip.error();
  std::vector<float> samples = resample(*clip, options_.sample_rate_hz).samples;
  const std::lock_guard lock(mutex_);
  if (!started_) return Error{ErrorCode::kFailed, "start() was not called: nobody listens"};
  const std::int64_t rate_hz = options_.sample_rate_hz;
  const std::int64_t heard = heard_frames();
  std::int64_t begin = std::max(heard, taken_);
  for (const Spoken& spoken : spoken_) {
    // a clip that was never there needs no pause
    if (!spoken.samples.empty()) begin = std::max(begin, spoken.end() + kPause_s * rate_hz);
  }
  if (begin - heard > kMostWaiting_s * rate_hz) {
    return Error{ErrorCode::kFailed, "more than 20 s of speech wait already"};
  }
  std::erase_if(spoken_, [this](const Spoken& spoken) { return spoken.end() <= taken_; });
  spoken_.push_back({begin, std::move(samples)});
  return static_cast<double>(started_ns_) * 1e-9 + static_cast<double>(begin) / static_cast<double>(rate_hz);
}

Status ClipAudio::start() {
  const std::lock_guard lock(mutex_);
  if (started_) return {};
  started_ = true;
  started_ns_ = clock_.now_ns();
  taken_ = 0;
  return {};
}

Status ClipAudio::stop() {
  const std::lock_guard lock(mutex_);
  started_ = false;
  return {};
}

float ClipAudio::pink_noise() {
  // splitmix64: the same on every machine
  random_ += 0x9E3779B97F4A7C15U;
  std::uint64_t bits = random_;
  bits = (bits ^ (bits >> 30U)) * 0xBF58476D1CE4E5B9U;
  bits = (bits ^ (bits >> 27U)) * 0x94D049BB133111EBU;
  bits ^= bits >> 31U;
  const double white = static_cast<double>(bits >> 11U) * 0x1p-52 - 1.0;
  // three first-order filters whose sum falls by 3 dB an octave over the range of speech
  low_ = 0.99765 * low_ + white * 0.0990460;
  middle_ = 0.96300 * middle_ + white * 0.2965164;
  high_ = 0.57000 * high_ + white * 1.0526913;
  return static_cast<float>((low_ + middle_ + high_ + white * 0.1848) / kPinkRms);
}

Result<Sound> ClipAudio::get_sound(std::size_t max_frames) {
  const std::lock_guard lock(mutex_);
  if (!started_) return Error{ErrorCode::kFailed, "start() was not called"};
  const std::int64_t rate_hz = options_.sample_rate_hz;
  const std::int64_t heard = heard_frames();
  // after a long pause the oldest is forgotten: no more than ten seconds are kept
  taken_ = std::max(taken_, heard - 10 * rate_hz);
  const std::int64_t frames = std::min(heard - taken_, static_cast<std::int64_t>(max_frames));
  Sound sound{started_ns_ + taken_ * kSecond_ns / rate_hz, options_.sample_rate_hz, 1, {}};
  const auto noise_rms = static_cast<float>(std::pow(10.0, options_.noise_db / 20.0));
  for (std::int64_t i = 0; i < frames; ++i) {
    float value = pink_noise() * noise_rms;
    for (const Spoken& spoken : spoken_) {
      const std::int64_t at = taken_ + i - spoken.begin;
      if (at >= 0 && taken_ + i < spoken.end()) value += spoken.samples[static_cast<std::size_t>(at)];
    }
    sound.samples.push_back(
        static_cast<std::int16_t>(std::lround(std::clamp(value, -1.0F, 1.0F) * 32767.0F)));
  }
  taken_ += std::max<std::int64_t>(frames, 0);
  return sound;
}

}  // namespace nido
