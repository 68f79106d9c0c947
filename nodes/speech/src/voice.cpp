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
  const double cutoff = std::min(1.0, to_hz / from_hz);
  const double reach = kHalfWidth / cutoff;
  const auto count = static_cast<std::size_t>(static_cast<double>(samples.size()) * to_hz / from_hz);
  std::vector<float> result(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double centre = static_cast<double>(i) * from_hz / to_hz;
    const auto first = static_cast<std::ptrdiff_t>(std::ceil(centre - reach));
    const auto last = static_cast<std::ptrdiff_t>(std::floor(centre + reach));
    double sum = 0.0;
    for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(0, first);
         k <= std::min(last, static_cast<std::ptrdiff_t>(samples.size()) - 1); ++k) {
      const double x = centre - static_cast<double>(k);
      const double phase = std::numbers::pi * x * cutoff;
      const double sinc = std::abs(phase) < 1e-9 ? 1.0 : std::sin(phase) / phase;
      const double window = 0.5 + 0.5 * std::cos(std::numbers::pi * x / reach);
      sum += samples[static_cast<std::size_t>(k)] * sinc * window * cutoff;
    }
    result[i] = static_cast<float>(sum);
  }
  return result;
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
