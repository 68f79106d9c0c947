#include "sounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

namespace nido {

namespace {

constexpr int kFft = 512;
constexpr double kRate_hz = 16000.0;
constexpr double kLowest_hz = 80.0;
constexpr double kHighest_hz = 7600.0;
constexpr const char* kHeader = "nido sound network 1\n";

double mel_of(double hz) { return 1127.0 * std::log1p(hz / 700.0); }

// The transform of a frame, and the bands: matrices, because frames are few.
struct Transform {
  Eigen::MatrixXf cosines;  // bin x sample
  Eigen::MatrixXf sines;
  Eigen::MatrixXf bands;  // band x bin

  Transform()
      : cosines(kFft / 2, kSpectrumWindow),
        sines(kFft / 2, kSpectrumWindow),
        bands(Eigen::MatrixXf::Zero(kSpectrumBands, kFft / 2)) {
    constexpr double kTurn = 2.0 * std::numbers::pi;
    for (int n = 0; n < kSpectrumWindow; ++n) {
      const double window = 0.5 - 0.5 * std::cos(kTurn * (n + 0.5) / kSpectrumWindow);
      for (int bin = 0; bin < kFft / 2; ++bin) {
        const double phase = kTurn * bin * n / kFft;
        cosines(bin, n) = static_cast<float>(window * std::cos(phase));
        sines(bin, n) = static_cast<float>(window * std::sin(phase));
      }
    }
    const double lowest = mel_of(kLowest_hz);
    const double step = (mel_of(kHighest_hz) - lowest) / (kSpectrumBands + 1);
    for (int bin = 0; bin < kFft / 2; ++bin) {
      const double place = (mel_of(bin * kRate_hz / kFft) - lowest) / step;  // band b has its peak at b + 1
      for (int band = 0; band < kSpectrumBands; ++band) {
        bands(band, bin) = static_cast<float>(std::max(0.0, 1.0 - std::abs(place - band - 1.0)));
      }
    }
  }
};

}  // namespace

std::optional<int> sound_of(const std::string& name) {
  const auto found = std::find(kSounds.begin(), kSounds.end(), name);
  if (found == kSounds.end()) return std::nullopt;
  return static_cast<int>(found - kSounds.begin());
}

Eigen::MatrixXf spectrum_of(const std::vector<std::int16_t>& samples) {
  static const Transform transform;
  if (samples.size() < kSpectrumWindow) return {kSpectrumBands, 0};
  const auto count = static_cast<Eigen::Index>((samples.size() - kSpectrumWindow) / kSpectrumHop + 1);
  Eigen::MatrixXf frames(kSpectrumWindow, count);
  for (Eigen::Index frame = 0; frame < count; ++frame) {
    for (Eigen::Index n = 0; n < kSpectrumWindow; ++n)
      frames(n, frame) = static_cast<float>(samples[static_cast<std::size_t>(frame * kSpectrumHop + n)]);
  }
  const Eigen::MatrixXf power =
      (transform.cosines * frames).array().square() + (transform.sines * frames).array().square();
  Eigen::MatrixXf spectrum = ((transform.bands * power).array() + 1.0F).log();
  spectrum.colwise() -= spectrum.rowwise().mean().eval();
  const float spread = std::sqrt(spectrum.squaredNorm() / static_cast<float>(spectrum.size()));
  return spectrum / std::max(spread, 1e-3F);
}

void SoundNetwork::input_of(const Eigen::MatrixXf& spectrum, Eigen::Index frame,
                            Eigen::Ref<Eigen::VectorXf> input) {
  for (std::size_t i = 0; i < kContext.size(); ++i) {
    const Eigen::Index at = std::clamp<Eigen::Index>(frame + kContext[i], 0, spectrum.cols() - 1);
    input.segment(static_cast<Eigen::Index>(i) * kSpectrumBands, kSpectrumBands) = spectrum.col(at);
  }
}

Eigen::MatrixXf SoundNetwork::log_probabilities(const Eigen::MatrixXf& spectrum) const {
  Eigen::MatrixXf layer(kInputs, spectrum.cols());
  for (Eigen::Index frame = 0; frame < spectrum.cols(); ++frame) input_of(spectrum, frame, layer.col(frame));
  for (std::size_t i = 0; i < weights.size(); ++i) {
    Eigen::MatrixXf next = weights[i] * layer;
    next.colwise() += biases[i];
    if (i + 1 < weights.size()) next = next.cwiseMax(0.0F);
    layer = std::move(next);
  }
  for (Eigen::Index frame = 0; frame < layer.cols(); ++frame) {
    const float highest = layer.col(frame).maxCoeff();
    layer.col(frame).array() -= highest + std::log((layer.col(frame).array() - highest).exp().sum());
  }
  return layer;
}

Result<SoundNetwork> SoundNetwork::load(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorCode::kNotFound, fmt::format("{}: there is no such network of sounds", path)};
  const Error broken{ErrorCode::kInvalidArgument, fmt::format("{}: not a network of sounds", path)};
  std::string header(std::string(kHeader).size(), '\0');
  file.read(header.data(), static_cast<std::streamsize>(header.size()));
  if (header != kHeader) return broken;
  SoundNetwork network;
  int inputs = kInputs;
  for (std::size_t i = 0; i < network.weights.size(); ++i) {
    std::int32_t outputs = 0;
    file.read(reinterpret_cast<char*>(&outputs), sizeof outputs);
    constexpr int kMost = 4096;
    if (!file || outputs < 1 || outputs > kMost) return broken;
    if (i + 1 == network.weights.size() && outputs != kOutputs) return broken;
    network.weights[i].resize(outputs, inputs);
    network.biases[i].resize(outputs);
    for (const auto& [data, size] : {std::pair{network.weights[i].data(), network.weights[i].size()},
                                     std::pair{network.biases[i].data(), network.biases[i].size()}}) {
      file.read(reinterpret_cast<char*>(data), static_cast<std::streamsize>(size * sizeof(float)));
    }
    if (!file || !network.weights[i].allFinite() || !network.biases[i].allFinite()) return broken;
    inputs = outputs;
  }
  return network;
}

Status SoundNetwork::save(const std::string& path) const {
  std::ofstream file(path, std::ios::binary);
  file << kHeader;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const auto outputs = static_cast<std::int32_t>(weights[i].rows());
    file.write(reinterpret_cast<const char*>(&outputs), sizeof outputs);
    for (const auto& [data, size] :
         {std::pair{weights[i].data(), weights[i].size()}, std::pair{biases[i].data(), biases[i].size()}}) {
      file.write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size * sizeof(float)));
    }
  }
  if (!file.flush()) return Error{ErrorCode::kFailed, fmt::format("cannot write {}", path)};
  return {};
}

}  // namespace nido
