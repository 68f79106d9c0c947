#include <fmt/format.h>

#include "nido/value/bytes.h"
#include "nido/yarp/image.h"

namespace nido::yarp {
namespace {

constexpr std::size_t kHeaderBytes = 48;
constexpr std::int32_t kSampleBytes = 2;
constexpr std::int32_t kMostChannels = 64;
constexpr std::int32_t kHighestRate_hz = 384'000;

}  // namespace

std::string encode_sound(const Sound& sound) {
  const auto frames = static_cast<std::int32_t>(sound.frames());
  std::string out;
  out.reserve(kHeaderBytes + sound.samples.size() * kSampleBytes);
  for (const std::int32_t word : {256, 5, 1, frames, 1, static_cast<std::int32_t>(sound.channels), 1,
                                  kSampleBytes, 1, static_cast<std::int32_t>(sound.sample_rate_hz), 256 + 64,
                                  static_cast<std::int32_t>(sound.samples.size())}) {
    put(out, word);
  }
  const auto channels = static_cast<std::size_t>(sound.channels);
  for (std::size_t channel = 0; channel < channels; ++channel) {
    for (std::size_t i = channel; i < sound.samples.size(); i += channels) put(out, sound.samples[i]);
  }
  return out;
}

Status decode_sound(std::string_view bytes, Sound& sound) {
  const auto wrong = [](std::string what) { return Error{ErrorCode::kInvalidArgument, std::move(what)}; };
  if (bytes.size() < kHeaderBytes) return wrong("a sound of fewer than 48 bytes");
  const auto word = [&](std::size_t index) { return get_at<std::int32_t>(bytes, index * 4); };
  if (word(0) != 256 || word(1) != 5 || word(2) != 1 || word(4) != 1 || word(6) != 1 || word(8) != 1 ||
      word(10) != 256 + 64) {
    return wrong("this is no sound: its header is another one's");
  }
  const std::int32_t frames = word(3);
  const std::int32_t channels = word(5);
  if (word(7) != kSampleBytes) return wrong(fmt::format("samples of {} bytes: 2 are expected", word(7)));
  if (channels < 1 || channels > kMostChannels || word(9) < 1 || word(9) > kHighestRate_hz) {
    return wrong(fmt::format("{} channels at {} Hz", channels, word(9)));
  }
  const std::size_t held = (bytes.size() - kHeaderBytes) / kSampleBytes;
  if (frames < 0 || word(11) < 0 || static_cast<std::size_t>(word(11)) != held ||
      static_cast<std::int64_t>(frames) * channels != word(11)) {
    return wrong(fmt::format("{} samples of {} channels do not fit {} bytes", frames, channels,
                             bytes.size() - kHeaderBytes));
  }
  sound.channels = channels;
  sound.sample_rate_hz = word(9);
  sound.samples.resize(held);
  std::size_t at = kHeaderBytes;
  for (std::size_t channel = 0; channel < static_cast<std::size_t>(channels); ++channel) {
    for (std::size_t i = channel; i < held; i += static_cast<std::size_t>(channels), at += kSampleBytes) {
      sound.samples[i] = get_at<std::int16_t>(bytes, at);
    }
  }
  return {};
}

}  // namespace nido::yarp
