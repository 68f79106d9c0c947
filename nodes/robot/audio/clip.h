#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// A sound of one channel, -1..1.
struct Clip {
  int sample_rate_hz = 0;
  std::vector<float> samples;
};

// Reads a sound file of any kind that libsndfile knows; channels are averaged. kNotFound when there is no
// such file; kInvalidArgument when it is no sound, or longer than ten minutes.
Result<Clip> read_sound_file(const std::filesystem::path& path);

// The same sound at another rate, through a windowed sinc filter below half of the lower rate.
Clip resample(const Clip& clip, int sample_rate_hz);

// The same sound with its greatest amplitude at `peak_db` below full scale (negative). Silence stays silence.
Clip normalised(Clip clip, double peak_db);

// Says a text with espeak-ng, a program of its own, which gets ten seconds of wall time. kNotFound, with the
// package's name, when it is not installed. The voice is one of `espeak-ng --voices`.
Result<Clip> synthesise_speech(const std::string& text, const std::string& voice);

}  // namespace nido
