#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace nido::attention {

// What the colours of the surface were like in the last pictures, against those around it: learned from the
// robot's own segments and soon forgotten, so that any surface will do.
class Appearance {
 public:
  void forget();
  [[nodiscard]] bool empty() const { return !known_; }
  // `surface`, `around`: 8U masks of the picture (8UC3). `memory`: share of the old knowledge that stays.
  void learn(const cv::Mat& picture, const cv::Mat& surface, const cv::Mat& around, double memory);
  // Log odds of belonging to the surface by colour, 32F, within +-limit; 0 for colours never seen.
  [[nodiscard]] cv::Mat log_odds(const cv::Mat& picture, double limit) const;

 private:
  bool known_ = false;
  std::vector<float> surface_;
  std::vector<float> around_;
};

}  // namespace nido::attention
