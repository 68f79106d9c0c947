#include <fmt/format.h>

#include "audio/clip.h"
#include "audio/clip_audio.h"
#include "audio/microphone.h"
#include "src/device_registry.h"

namespace nido {
namespace {

Result<Clip> clip_of(const AudioSettings& audio) {
  if (audio.source == "wav") return read_sound_file(audio.file);
  if (audio.source == "synthesis") return synthesise_speech(audio.text, audio.voice);
  return Clip{};
}

Result<MadeDevice> make_ears(const YAML::Node& parameters, DeviceContext& context) {
  const AudioSettings& audio = context.run.audio;
  const int sample_rate_hz = parameters["sample_rate_hz"].as<int>();
  if (audio.source == "microphone") {
    Result<std::unique_ptr<IAudioGrabberSound>> microphone = open_microphone(sample_rate_hz, context.clock);
    if (!microphone) return microphone.error();
    return MadeDevice{std::move(*microphone)};
  }
  const Result<Clip> clip = clip_of(audio);
  if (!clip)
    return Error{clip.error().code, fmt::format("audio source {}: {}", audio.source, clip.error().message)};
  const ClipAudioOptions options{.sample_rate_hz = sample_rate_hz,
                                 .start_s = audio.start_s,
                                 .noise_db = parameters["noise_db"].as<double>(),
                                 .seed = context.run.seed};
  return MadeDevice{
      std::unique_ptr<IAudioGrabberSound>(std::make_unique<ClipAudio>(*clip, options, context.clock))};
}

}  // namespace

std::vector<DeviceKind> audio_family() {
  return {{"audio/ears",
           {"device audio/ears",
            "",
            {{.key = "sample_rate_hz",
              .kind = ValueKind::kInteger,
              .fallback = "16000",
              .meaning = "samples a second, one channel",
              .min = 8000,
              .max = 48000},
             {.key = "noise_db",
              .kind = ValueKind::kNumber,
              .fallback = "-55",
              .meaning = "noise of the room, rms below full scale, dB; not for a real microphone",
              .min = -120,
              .max = 0}}},
           &make_ears}};
}

}  // namespace nido
