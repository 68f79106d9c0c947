#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// Something to be heard that is no phrase.
struct OtherSpeech {
  std::string kind;  // "near miss", "own words", "sentence", "tones", "noise"
  std::string text;  // empty: a sound
  std::uint64_t seed = 0;
};

// `count` of them, different texts, mixed; the same seed gives the same. About two thirds are near misses and
// a tenth are sounds.
// `tuning`: with words of their own, to choose bounds and costs with.
std::vector<OtherSpeech> other_speech(std::size_t count, std::uint64_t seed, bool tuning = false);

// Every word of them: the recogniser must not know them beforehand.
std::set<std::string> other_words();

// The sound of a kind without text: tones like music, or bursts of noise, 16 kHz, with silence around.
Result<std::vector<std::int16_t>> make_sound(const std::string& kind, std::uint64_t seed,
                                             double silence_after_s);

}  // namespace nido
