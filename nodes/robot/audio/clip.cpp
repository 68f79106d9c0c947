#include "audio/clip.h"

#include <fmt/format.h>
#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>

namespace nido {
namespace {

constexpr double kLongest_s = 600;
constexpr int kSincLobes = 16;  // on each side

struct CloseSoundFile {
  void operator()(SNDFILE* file) const { sf_close(file); }
};

}  // namespace

Result<Clip> read_sound_file(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) {
    return Error{ErrorCode::kNotFound, fmt::format("no sound file {}", path.string())};
  }
  SF_INFO info{};
  const std::unique_ptr<SNDFILE, CloseSoundFile> file(sf_open(path.c_str(), SFM_READ, &info));
  if (!file) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("{}: {}", path.string(), sf_strerror(nullptr))};
  }
  if (info.samplerate <= 0 || info.channels <= 0 ||
      static_cast<double>(info.frames) > kLongest_s * info.samplerate) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}: a sound of at most {} s is expected", path.string(), kLongest_s)};
  }
  const auto channels = static_cast<std::size_t>(info.channels);
  std::vector<float> interleaved(4096 * channels);
  Clip clip{info.samplerate, {}};
  // a header that promises more than there is, as of a stream, is no harm: reading ends with the data
  for (;;) {
    const sf_count_t read = sf_readf_float(file.get(), interleaved.data(), 4096);
    if (read <= 0) return clip;
    for (std::size_t frame = 0; frame < static_cast<std::size_t>(read); ++frame) {
      const auto first = interleaved.begin() + static_cast<std::ptrdiff_t>(frame * channels);
      clip.samples.push_back(std::accumulate(first, first + info.channels, 0.0F) /
                             static_cast<float>(channels));
    }
  }
}

Clip resample(const Clip& clip, int sample_rate_hz) {
  if (clip.sample_rate_hz == sample_rate_hz || clip.samples.empty()) return {sample_rate_hz, clip.samples};
  const double step = static_cast<double>(clip.sample_rate_hz) / sample_rate_hz;
  const double cutoff = std::min(1.0, 1.0 / step);  // of half the source's rate
  const double reach = kSincLobes / cutoff;         // source samples on each side
  const auto last = static_cast<std::ptrdiff_t>(clip.samples.size()) - 1;
  Clip out{sample_rate_hz, std::vector<float>(static_cast<std::size_t>(
                               std::floor(static_cast<double>(clip.samples.size()) / step)))};
  for (std::size_t i = 0; i < out.samples.size(); ++i) {
    const double centre = static_cast<double>(i) * step;
    const auto begin = std::max<std::ptrdiff_t>(0, static_cast<std::ptrdiff_t>(std::ceil(centre - reach)));
    const auto end = std::min(last, static_cast<std::ptrdiff_t>(std::floor(centre + reach)));
    double sum = 0;
    for (std::ptrdiff_t j = begin; j <= end; ++j) {
      const double x = static_cast<double>(j) - centre;
      const double phase = std::numbers::pi * x * cutoff;
      const double sinc = std::abs(phase) < 1e-9 ? 1.0 : std::sin(phase) / phase;
      const double window = 0.5 + 0.5 * std::cos(std::numbers::pi * x / reach);
      sum += clip.samples[static_cast<std::size_t>(j)] * sinc * window * cutoff;
    }
    out.samples[i] = static_cast<float>(sum);
  }
  return out;
}

Clip normalised(Clip clip, double peak_db) {
  float peak = 0;
  for (const float sample : clip.samples) peak = std::max(peak, std::abs(sample));
  if (peak > 0) {
    const auto gain = static_cast<float>(std::pow(10.0, peak_db / 20.0)) / peak;
    for (float& sample : clip.samples) sample *= gain;
  }
  return clip;
}

}  // namespace nido
