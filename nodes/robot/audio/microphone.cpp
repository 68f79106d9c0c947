#include "audio/microphone.h"

#include <portaudio.h>

#include <algorithm>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

namespace nido {
namespace {

constexpr std::size_t kKept_s = 10;
constexpr unsigned long kFramesAtOnce = 160;

Error failure(const std::string& what, PaError code) {
  return Error{ErrorCode::kNotFound, "microphone: " + what + ": " + Pa_GetErrorText(code)};
}

class Microphone final : public IAudioGrabberSound {
 public:
  Microphone(int sample_rate_hz, const IClock& clock) : sample_rate_hz_(sample_rate_hz), clock_(clock) {}
  ~Microphone() override {
    if (stream_ != nullptr) Pa_CloseStream(stream_);
    if (is_initialised_) Pa_Terminate();
  }
  Microphone(const Microphone&) = delete;
  Microphone& operator=(const Microphone&) = delete;

  Status open() {
    if (const PaError code = Pa_Initialize(); code != paNoError) return failure("no audio system", code);
    is_initialised_ = true;
    if (Pa_GetDefaultInputDevice() == paNoDevice) {
      return Error{ErrorCode::kNotFound,
                   "this computer has no microphone: choose audio source wav or synthesis"};
    }
    const PaError code =
        Pa_OpenDefaultStream(&stream_, 1, 0, paInt16, sample_rate_hz_, kFramesAtOnce, &heard, this);
    return code == paNoError ? Status() : Status(failure("cannot be opened", code));
  }

  int sample_rate_hz() const override { return sample_rate_hz_; }
  int channels() const override { return 1; }

  Status start() override {
    if (Pa_IsStreamActive(stream_) == 1) return {};
    const PaError code = Pa_StartStream(stream_);
    return code == paNoError ? Status() : Status(failure("cannot be started", code));
  }
  Status stop() override {
    if (Pa_IsStreamActive(stream_) == 1) Pa_StopStream(stream_);
    const std::lock_guard lock(mutex_);
    kept_.clear();
    return {};
  }
  Result<Sound> get_sound(std::size_t max_frames) override {
    if (Pa_IsStreamActive(stream_) != 1) return Error{ErrorCode::kFailed, "the microphone is not running"};
    const std::lock_guard lock(mutex_);
    const std::size_t frames = std::min(max_frames, kept_.size());
    const auto end = kept_.begin() + static_cast<std::ptrdiff_t>(frames);
    const std::int64_t age_ns = static_cast<std::int64_t>(kept_.size()) * 1'000'000'000 / sample_rate_hz_;
    Sound sound{clock_.now_ns() - age_ns, sample_rate_hz_, 1, {kept_.begin(), end}};
    kept_.erase(kept_.begin(), end);
    return sound;
  }

 private:
  static int heard(const void* input, void*, unsigned long frames, const PaStreamCallbackTimeInfo*,
                   PaStreamCallbackFlags, void* self) {
    auto& microphone = *static_cast<Microphone*>(self);
    const auto* samples = static_cast<const std::int16_t*>(input);
    if (samples == nullptr) return paContinue;
    const std::lock_guard lock(microphone.mutex_);
    std::deque<std::int16_t>& kept = microphone.kept_;
    kept.insert(kept.end(), samples, samples + frames);
    const std::size_t most = kKept_s * static_cast<std::size_t>(microphone.sample_rate_hz_);
    if (kept.size() > most) kept.erase(kept.begin(), kept.end() - static_cast<std::ptrdiff_t>(most));
    return paContinue;
  }

  const int sample_rate_hz_;
  const IClock& clock_;
  bool is_initialised_ = false;
  PaStream* stream_ = nullptr;
  std::mutex mutex_;
  std::deque<std::int16_t> kept_;
};

}  // namespace

Result<std::unique_ptr<IAudioGrabberSound>> open_microphone(int sample_rate_hz, const IClock& clock) {
  auto microphone = std::make_unique<Microphone>(sample_rate_hz, clock);
  if (Status opened = microphone->open(); !opened) return opened.error();
  return std::unique_ptr<IAudioGrabberSound>(std::move(microphone));
}

}  // namespace nido
