#include <fmt/format.h>

#include "audio/clip.h"
#include "audio/clip_audio.h"
#include "audio/microphone.h"
#include "audio/room_speaker.h"
#include "nido/speech/phrases.h"
#include "src/device_registry.h"

namespace nido {
namespace {

// Everything that is said in a run, with the pauses between.
Result<Clip> say_orders(const std::string& text, const std::string& voice) {
  constexpr double kPause_s = 1.0;
  Clip all;
  for (const SpokenOrder& order : split_orders(text)) {
    const Result<Clip> clip = synthesise_speech(order.text, voice);
    if (!clip) return clip.error();
    all.sample_rate_hz = clip->sample_rate_hz;
    const double end_s = static_cast<double>(all.samples.size()) / clip->sample_rate_hz;
    const double start_s = order.at_s.value_or(all.samples.empty() ? 0.0 : end_s + kPause_s);
    if (start_s < end_s) {
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("'{}' is to be said at {} s, but what comes before it ends at {:.1f} s",
                               order.text, start_s, end_s)};
    }
    all.samples.resize(static_cast<std::size_t>(start_s * clip->sample_rate_hz), 0.0F);
    all.samples.insert(all.samples.end(), clip->samples.begin(), clip->samples.end());
  }
  if (all.samples.empty()) return Error{ErrorCode::kInvalidArgument, "there is no text to say"};
  return all;
}

Result<Clip> clip_of(const AudioSettings& audio) {
  if (audio.source == "wav") return read_sound_file(audio.file);
  if (audio.source == "synthesis") return say_orders(audio.text, audio.voice);
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

Result<MadeDevice> make_speaker(const YAML::Node& parameters, DeviceContext& context) {
  return MadeDevice{std::unique_ptr<IAudioRender>(std::make_unique<RoomSpeaker>(
      context.run.said, parameters["sample_rate_hz"].as<int>(), context.clock))};
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
           &make_ears},
          {"audio/speaker",
           {"device audio/speaker",
            "",
            {{.key = "sample_rate_hz",
              .kind = ValueKind::kInteger,
              .fallback = "16000",
              .meaning = "samples a second of the sound file",
              .min = 8000,
              .max = 48000}}},
           &make_speaker}};
}

}  // namespace nido
