#include "nido/simulator/render/picture_noise.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace nido::sim {
namespace {

constexpr int kChannels = 3;

// A number that has nothing to do with its neighbours' (splitmix64).
std::uint64_t mixed(std::uint64_t value) {
  value += 0x9e3779b97f4a7c15ULL;
  value = (value ^ value >> 30) * 0xbf58476d1ce4e5b9ULL;
  value = (value ^ value >> 27) * 0x94d049bb133111ebULL;
  return value ^ value >> 31;
}

// Weights of a bell curve, normalised over both sides.
std::vector<float> makeKernel(double sigma_px) {
  if (sigma_px <= 0) return {};
  const int reach = std::max(1, static_cast<int>(std::ceil(3 * sigma_px)));
  std::vector<double> weights;
  double sum = 0;
  for (int i = 0; i <= reach; ++i) {
    weights.push_back(std::exp(-0.5 * i * i / (sigma_px * sigma_px)));
    sum += i == 0 ? weights.back() : 2 * weights.back();
  }
  std::vector<float> kernel;
  for (const double weight : weights) kernel.push_back(static_cast<float>(weight / sum));
  return kernel;
}

// Filters `count` values of one line that lie `stride` bytes apart; beyond its ends the line goes on with its
// end values.
void filterLine(std::uint8_t* values, int count, std::ptrdiff_t stride, const std::vector<float>& kernel,
                std::vector<float>& line) {
  const int reach = static_cast<int>(kernel.size()) - 1;
  line.resize(static_cast<std::size_t>(count + 2 * reach));
  for (int i = -reach; i < count + reach; ++i) {
    line[static_cast<std::size_t>(i + reach)] = values[std::clamp(i, 0, count - 1) * stride];
  }
  for (int i = 0; i < count; ++i) {
    const float* middle = line.data() + i + reach;
    float sum = kernel[0] * *middle;
    for (int k = 1; k <= reach; ++k) sum += kernel[static_cast<std::size_t>(k)] * (middle[-k] + middle[k]);
    values[i * stride] = static_cast<std::uint8_t>(std::clamp(sum + 0.5F, 0.0F, 255.0F));
  }
}

}  // namespace

Result<PictureNoise> PictureNoise::create(const NoiseOptions& options) {
  if (!(options.blur_px >= 0 && options.blur_px <= 5)) {
    return Error{ErrorCode::kInvalidArgument,
                 "camera: blur is " + std::to_string(options.blur_px) + " pixels, expected 0 to 5"};
  }
  if (!(options.noise_levels >= 0 && options.noise_levels <= 64)) {
    return Error{ErrorCode::kInvalidArgument,
                 "camera: noise is " + std::to_string(options.noise_levels) + " levels, expected 0 to 64"};
  }
  return PictureNoise(options);
}

PictureNoise::PictureNoise(const NoiseOptions& options)
    : options_(options), kernel_(makeKernel(options.blur_px)) {}

void PictureNoise::blur(Image& picture) {
  const std::ptrdiff_t row_bytes = static_cast<std::ptrdiff_t>(picture.width) * kChannels;
  for (int row = 0; row < picture.height; ++row) {
    for (int channel = 0; channel < kChannels; ++channel) {
      filterLine(picture.rgb.data() + row * row_bytes + channel, picture.width, kChannels, kernel_,
                 row_buffer_);
    }
  }
  for (std::ptrdiff_t column = 0; column < row_bytes; ++column) {
    filterLine(picture.rgb.data() + column, picture.height, row_bytes, kernel_, row_buffer_);
  }
}

void PictureNoise::apply(Image& picture, std::uint64_t moment) {
  if (!kernel_.empty() && !picture.rgb.empty()) blur(picture);
  if (options_.noise_levels <= 0) return;
  // the sum of four random bytes is close to a bell curve of mean 510 and this deviation
  const double deviation = std::sqrt(4 * (256.0 * 256.0 - 1) / 12);
  const auto scale = static_cast<std::int32_t>(std::lround(options_.noise_levels / deviation * 65536));
  std::uint64_t state = mixed(mixed(options_.seed) + moment) | 1U;  // never 0
  std::uint64_t random = 0;
  for (std::size_t i = 0; i < picture.rgb.size(); ++i) {
    if (i % 2 == 0) {  // xorshift64*
      state ^= state >> 12;
      state ^= state << 25;
      state ^= state >> 27;
      random = state * 0x2545f4914f6cdd1dULL;
    } else {
      random >>= 32;
    }
    const auto sum = static_cast<std::int32_t>((random & 255) + (random >> 8 & 255) + (random >> 16 & 255) +
                                               (random >> 24 & 255));
    const std::int32_t value = picture.rgb[i] + (((sum - 510) * scale + 32768) >> 16);
    picture.rgb[i] = static_cast<std::uint8_t>(std::clamp(value, 0, 255));
  }
}

}  // namespace nido::sim
