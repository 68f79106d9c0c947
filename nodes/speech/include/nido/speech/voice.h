#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// How a sentence is spoken by espeak-ng.
struct Voice {
  std::string name = "en-us";  // "en-us", "en-us+f3", "en-gb": see `espeak-ng --voices`
  int words_per_minute = 150;
  int pitch = 50;  // 0..99
};

// Speaks a sentence: 16 kHz, one channel, peak at -3 dB, with silence before and after. Starts the program
// espeak-ng and waits for it. kNotFound if it is not installed, kInvalidArgument if it refuses the voice.
Result<std::vector<std::int16_t>> speak(const std::string& sentence, const Voice& voice,
                                        double silence_before_s = 0.3, double silence_after_s = 0.4);

// Noise to try recognisers with.
enum class NoiseKind { kPink, kWhite };
// Adds noise `snr_db` below the power of the speech, which is what is louder than a hundredth of the peak.
void add_noise(std::vector<std::int16_t>& samples, NoiseKind kind, double snr_db, std::uint64_t seed);

// Changes the sample rate by band-limited interpolation. Rates in Hz, both positive.
std::vector<float> resample(const std::vector<float>& samples, double from_hz, double to_hz);

}  // namespace nido
