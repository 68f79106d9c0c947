#include "nido/speech/voice.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sndfile.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <numbers>
#include <random>

extern char** environ;

namespace nido {

namespace {

constexpr double kRate_hz = 16000.0;
constexpr double kPeak = 0.708 * 32767.0;  // -3 dB

// runs espeak-ng without a shell; returns its exit code
int run_espeak(const std::vector<std::string>& arguments) {
  std::vector<char*> argv;
  for (const auto& argument : arguments) {
    argv.push_back(
        const_cast<char*>(argument.c_str()));  // NOLINT(cppcoreguidelines-pro-type-const-cast): spawn's type
  }
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int spawned = posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (spawned != 0) return 127;
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 126;
}

}  // namespace

std::vector<float> resample(const std::vector<float>& samples, double from_hz, double to_hz) {
  constexpr double kHalfWidth = 16.0;  // zero crossings of the kernel on each side
  constexpr int kPhases = 512;         // the kernel is tabled, and read between its points by a straight line
  const double cutoff = std::min(1.0, to_hz / from_hz);
  const double reach = kHalfWidth / cutoff;
  std::vector<float> kernel(static_cast<std::size_t>(reach * kPhases) + 3, 0.0F);
  for (std::size_t k = 0; k < kernel.size(); ++k) {
    const double x = static_cast<double>(k) / kPhases;
    if (x > reach) break;
    const double phase = std::numbers::pi * x * cutoff;
    const double sinc = phase < 1e-9 ? 1.0 : std::sin(phase) / phase;
    kernel[k] = static_cast<float>(sinc * (0.5 + 0.5 * std::cos(std::numbers::pi * x / reach)) * cutoff);
  }
  const auto count = static_cast<std::size_t>(static_cast<double>(samples.size()) * to_hz / from_hz);
  std::vector<float> result(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double centre = static_cast<double>(i) * from_hz / to_hz;
    const auto first = std::max<std::ptrdiff_t>(0, static_cast<std::ptrdiff_t>(std::ceil(centre - reach)));
    const auto last = std::min(static_cast<std::ptrdiff_t>(std::floor(centre + reach)),
                               static_cast<std::ptrdiff_t>(samples.size()) - 1);
    double sum = 0.0;
    for (std::ptrdiff_t k = first; k <= last; ++k) {
      const double place = std::abs(centre - static_cast<double>(k)) * kPhases;
      const auto index = static_cast<std::size_t>(place);
      const double rest = place - static_cast<double>(index);
      sum += samples[static_cast<std::size_t>(k)] *
             (kernel[index] + rest * static_cast<double>(kernel[index + 1] - kernel[index]));
    }
    result[i] = static_cast<float>(sum);
  }
  return result;
}

void add_noise(std::vector<std::int16_t>& samples, NoiseKind kind, double snr_db, std::uint64_t seed) {
  int peak = 1;
  for (const auto sample : samples) peak = std::max(peak, std::abs(static_cast<int>(sample)));
  double power = 0.0;
  double count = 0.0;
  for (const auto sample : samples) {
    if (std::abs(static_cast<int>(sample)) * 100 > peak) {
      power += static_cast<double>(sample) * sample;
      count += 1.0;
    }
  }
  std::mt19937_64 generator(seed);
  std::vector<double> sound(samples.size());
  double b0 = 0.0;
  double b1 = 0.0;
  double b2 = 0.0;
  double noise_power = 0.0;
  for (double& value : sound) {
    const double white = static_cast<double>(generator() >> 11U) * 0x1p-53 - 0.5;
    // pink by three one-pole filters
    b0 = 0.99765 * b0 + white * 0.0990460;
    b1 = 0.96300 * b1 + white * 0.2965164;
    b2 = 0.57000 * b2 + white * 1.0526913;
    value = kind == NoiseKind::kPink ? b0 + b1 + b2 + white * 0.1848 : white;
    noise_power += value * value;
  }
  noise_power /= std::max(1.0, static_cast<double>(sound.size()));
  const double gain = std::sqrt(power / std::max(1.0, count) / noise_power * std::pow(10.0, -snr_db / 10.0));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i] =
        static_cast<std::int16_t>(std::clamp(std::lround(samples[i] + gain * sound[i]), -32768L, 32767L));
  }
}

Result<std::vector<std::int16_t>> speak(const std::string& sentence, const Voice& voice,
                                        double silence_before_s, double silence_after_s) {
  // synthesise into a file of our own
  std::string path = (std::filesystem::temp_directory_path() / "nido-voice-XXXXXX").string();
  const int descriptor = mkstemp(path.data());
  if (descriptor < 0) {
    return Error{ErrorCode::kFailed, fmt::format("cannot make the temporary file {}", path)};
  }
  close(descriptor);
  const int code = run_espeak({"espeak-ng", "-v", voice.name, "-s", std::to_string(voice.words_per_minute),
                               "-p", std::to_string(voice.pitch), "-w", path, "--", sentence});
  SF_INFO info{};
  const std::unique_ptr<SNDFILE, int (*)(SNDFILE*)> file(sf_open(path.c_str(), SFM_READ, &info), sf_close);
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  if (code == 127) {
    return Error{ErrorCode::kNotFound, "the program espeak-ng is missing: install the package espeak-ng"};
  }
  if (code != 0 || !file || info.frames <= 0 || info.channels != 1) {
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("espeak-ng does not speak with the voice '{}': see espeak-ng --voices", voice.name)};
  }
  std::vector<float> raw(static_cast<std::size_t>(info.frames));
  raw.resize(
      static_cast<std::size_t>(std::max<sf_count_t>(0, sf_readf_float(file.get(), raw.data(), info.frames))));

  // to the recogniser's rate and level
  const std::vector<float> sound = resample(raw, info.samplerate, kRate_hz);
  float peak = 1e-6F;
  for (const float sample : sound) {
    peak = std::max(peak, std::abs(sample));
  }
  // without the silence that espeak-ng puts around a sentence
  const auto loud = [&](float sample) { return std::abs(sample) > 0.01F * peak; };
  const auto first = std::find_if(sound.begin(), sound.end(), loud);
  const auto last = std::find_if(sound.rbegin(), sound.rend(), loud).base();
  std::vector<std::int16_t> samples(static_cast<std::size_t>(silence_before_s * kRate_hz), 0);
  for (auto sample = first; sample < last; ++sample) {
    samples.push_back(static_cast<std::int16_t>(std::lround(*sample / peak * kPeak)));
  }
  samples.resize(samples.size() + static_cast<std::size_t>(silence_after_s * kRate_hz), 0);
  return samples;
}

}  // namespace nido
