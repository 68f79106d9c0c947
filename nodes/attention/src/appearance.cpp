#include "nido/attention/appearance.h"

#include <algorithm>
#include <cmath>

namespace nido::attention {
namespace {

constexpr int kLevels = 16;  // of each of red, green, blue
constexpr std::size_t kBins = static_cast<std::size_t>(kLevels) * kLevels * kLevels;
constexpr float kUnseen = 2e-4F;  // chance of a colour that has not come yet

std::size_t bin_of(const cv::Vec3b& colour) {
  return (static_cast<std::size_t>(colour[0] / 16) * kLevels + colour[1] / 16) * kLevels + colour[2] / 16;
}

// Shade moves colours into the neighbour's bin.
void blur(std::vector<float>& bins) {
  for (const std::size_t stride : {std::size_t{1}, std::size_t{kLevels}, std::size_t{kLevels} * kLevels}) {
    const std::vector<float> sharp = bins;
    for (std::size_t i = 0; i < kBins; ++i) {
      const std::size_t level = i / stride % kLevels;
      bins[i] = 0.5F * sharp[i];
      bins[i] += 0.25F * sharp[level > 0 ? i - stride : i];
      bins[i] += 0.25F * sharp[level + 1 < kLevels ? i + stride : i];
    }
  }
}

std::vector<float> histogram(const cv::Mat& picture, const cv::Mat& mask) {
  std::vector<float> bins(kBins, 0.F);
  float sum = 0;
  for (int y = 0; y < picture.rows; ++y) {
    const auto* colour = picture.ptr<cv::Vec3b>(y);
    const auto* on = mask.ptr<std::uint8_t>(y);
    for (int x = 0; x < picture.cols; ++x) {
      if (on[x] == 0) continue;
      bins[bin_of(colour[x])] += 1;
      sum += 1;
    }
  }
  if (sum < 1) return {};
  for (float& bin : bins) bin /= sum;
  blur(bins);
  return bins;
}

void mix(std::vector<float>& old, const std::vector<float>& fresh, double memory) {
  if (fresh.empty()) return;
  if (old.empty()) {
    old = fresh;
    return;
  }
  const auto keep = static_cast<float>(memory);
  for (std::size_t i = 0; i < kBins; ++i) old[i] = keep * old[i] + (1 - keep) * fresh[i];
}

}  // namespace

void Appearance::forget() {
  known_ = false;
  surface_.clear();
  around_.clear();
}

void Appearance::learn(const cv::Mat& picture, const cv::Mat& surface, const cv::Mat& around, double memory) {
  mix(surface_, histogram(picture, surface), memory);
  mix(around_, histogram(picture, around), memory);
  known_ = !surface_.empty() && !around_.empty();
}

cv::Mat Appearance::log_odds(const cv::Mat& picture, double limit) const {
  cv::Mat odds = cv::Mat::zeros(picture.size(), CV_32F);
  if (!known_) return odds;
  std::vector<float> table(kBins);
  const auto most = static_cast<float>(limit);
  for (std::size_t i = 0; i < kBins; ++i) {
    table[i] = std::clamp(std::log((surface_[i] + kUnseen) / (around_[i] + kUnseen)), -most, most);
  }
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      odds.at<float>(y, x) = table[bin_of(picture.at<cv::Vec3b>(y, x))];
    }
  }
  return odds;
}

}  // namespace nido::attention
