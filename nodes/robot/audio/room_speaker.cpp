#include "audio/room_speaker.h"

#include <fmt/format.h>
#include <sndfile.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "audio/clip.h"

namespace nido {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kMostWaiting_s = 30;

// one channel, -1..1
Clip as_clip(const Sound& sound) {
  const auto channels = static_cast<std::size_t>(sound.channels);
  Clip clip{sound.sample_rate_hz, std::vector<float>(sound.frames())};
  for (std::size_t i = 0; i < clip.samples.size(); ++i) {
    int sum = 0;
    for (std::size_t channel = 0; channel < channels; ++channel) sum += sound.samples[i * channels + channel];
    clip.samples[i] = static_cast<float>(sum) / 32768.0F / static_cast<float>(channels);
  }
  return clip;
}

}  // namespace

void RoomSpeaker::CloseFile::operator()(sf_private_tag* file) const { sf_close(file); }

RoomSpeaker::RoomSpeaker(std::filesystem::path file, int sample_rate_hz, const IClock& clock)
    : path_(std::move(file)), sample_rate_hz_(sample_rate_hz), clock_(clock), begin_ns_(clock.now_ns()) {}

std::int64_t RoomSpeaker::frames_until_now() const {
  return (clock_.now_ns() - begin_ns_) * sample_rate_hz_ / kSecond_ns;
}

Status RoomSpeaker::start() {
  const std::lock_guard lock(mutex_);
  started_ = true;
  return {};
}

Status RoomSpeaker::stop() {
  const std::lock_guard lock(mutex_);
  started_ = false;
  ends_after_ = std::min(ends_after_, frames_until_now());
  // what would have been heard later is taken back
  if (file_ && written_ > ends_after_) {
    sf_count_t end = ends_after_;
    sf_command(file_.get(), SFC_FILE_TRUNCATE, &end, sizeof end);
    sf_seek(file_.get(), 0, SEEK_END);
    written_ = ends_after_;
  }
  return {};
}

Status RoomSpeaker::render(const Sound& sound) {
  if (Status valid = check_sound(sound); !valid) return valid;
  const std::lock_guard lock(mutex_);
  if (!started_) return Error{ErrorCode::kFailed, "the loudspeaker was not started"};
  const std::int64_t now = frames_until_now();
  const std::int64_t begin = std::max(ends_after_, now);
  const std::int64_t frames =
      static_cast<std::int64_t>(sound.frames()) * sample_rate_hz_ / sound.sample_rate_hz;
  if (begin + frames - now > kMostWaiting_s * sample_rate_hz_) {
    return Error{
        ErrorCode::kFailed,
        fmt::format("more than {} s would wait for the loudspeaker: wait, or stop it", kMostWaiting_s)};
  }
  if (Status written = path_.empty() ? Status() : write(sound, begin, frames); !written) return written;
  ends_after_ = begin + frames;
  return {};
}

Status RoomSpeaker::write(const Sound& sound, std::int64_t begin, std::int64_t frames) {
  if (!file_) {
    SF_INFO info{};
    info.samplerate = static_cast<int>(sample_rate_hz_);
    info.channels = 1;
    info.format = SF_FORMAT_WAV | SF_FORMAT_PCM_16;
    file_.reset(sf_open(path_.c_str(), SFM_WRITE, &info));
    if (!file_) {
      return Error{ErrorCode::kFailed, fmt::format("{}: {}", path_.string(), sf_strerror(nullptr))};
    }
    // however the process ends, the file is whole
    sf_command(file_.get(), SFC_SET_UPDATE_HEADER_AUTO, nullptr, SF_TRUE);
  }
  Clip clip = as_clip(sound);
  if (clip.sample_rate_hz != sample_rate_hz_) clip = resample(clip, static_cast<int>(sample_rate_hz_));
  std::vector<float> samples(static_cast<std::size_t>(begin - written_), 0.0F);
  samples.insert(samples.end(), clip.samples.begin(), clip.samples.end());
  samples.resize(static_cast<std::size_t>(begin - written_ + frames), 0.0F);
  const auto count = static_cast<sf_count_t>(samples.size());
  if (sf_writef_float(file_.get(), samples.data(), count) != count) {
    return Error{ErrorCode::kFailed, fmt::format("{} cannot be written: is the disk full?", path_.string())};
  }
  written_ = begin + frames;
  return {};
}

double RoomSpeaker::waiting_s() const {
  const std::lock_guard lock(mutex_);
  return static_cast<double>(std::max<std::int64_t>(0, ends_after_ - frames_until_now())) /
         static_cast<double>(sample_rate_hz_);
}

}  // namespace nido
