#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// The sounds that speech is made of, as dictionaries write them (ARPAbet), and silence.
inline constexpr std::array<const char*, 40> kSounds = {
    "SIL", "AA", "AE", "AH", "AO", "AW", "AY", "B", "CH", "D", "DH", "EH", "ER", "EY",
    "F",   "G",  "HH", "IH", "IY", "JH", "K",  "L", "M",  "N", "NG", "OW", "OY", "P",
    "R",   "S",  "SH", "T",  "TH", "UH", "UW", "V", "W",  "Y", "Z",  "ZH"};
inline constexpr int kSilence = 0;
// Index into kSounds; nothing for other names.
std::optional<int> sound_of(const std::string& name);

// How loud an utterance (16 kHz, one channel) is in 32 bands on the mel scale, in logarithms, one column a
// frame of 10 ms: relative to the band's average over the utterance, divided by the spread of all.
Eigen::MatrixXf spectrum_of(const std::vector<std::int16_t>& samples);
inline constexpr int kSpectrumBands = 32;
inline constexpr int kSpectrumHop = 160;     // samples from frame to frame
inline constexpr int kSpectrumWindow = 400;  // samples of a frame

// Two hidden layers of rectified units that tell the sound of a frame from the spectrum around it.
struct SoundNetwork {
  // Frames that it looks at, relative to the one that it judges.
  static constexpr std::array<int, 15> kContext = {-12, -9, -6, -4, -3, -2, -1, 0, 1, 2, 3, 4, 6, 9, 12};
  static constexpr int kInputs = kSpectrumBands * static_cast<int>(kContext.size());
  static constexpr int kOutputs = static_cast<int>(kSounds.size());

  std::array<Eigen::MatrixXf, 3> weights;
  std::array<Eigen::VectorXf, 3> biases;

  // What it looks at to judge frame `frame`; beyond the ends the last frame goes on.
  static void input_of(const Eigen::MatrixXf& spectrum, Eigen::Index frame,
                       Eigen::Ref<Eigen::VectorXf> input);
  // Natural logarithm of the probability of every sound (row) in every frame (column).
  [[nodiscard]] Eigen::MatrixXf log_probabilities(const Eigen::MatrixXf& spectrum) const;

  // kNotFound if there is no such file, kInvalidArgument if it is no network of this shape.
  static Result<SoundNetwork> load(const std::string& path);
  [[nodiscard]] Status save(const std::string& path) const;
};

}  // namespace nido
