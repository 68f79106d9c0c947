#pragma once

#include <opencv2/core.hpp>

namespace nido::attention {

struct FieldSettings {
  double smooth = 2.0;        // coupling of neighbours that look alike
  double smooth_edge = 0.05;  // and of those that do not: over an edge of the picture
};

// The most likely state of a binary Markov random field on the pixels of a picture: every pixel belongs to
// the surface or not, follows its own evidence and wants to be like its four neighbours, the more the more
// they look alike. Exact, by the smallest cut of a graph (Greig, Porteous, Seheult 1989; Boykov, Kolmogorov
// 2004). `evidence`: 32F, half the log odds of belonging; `picture`: 8UC3 of the same size. Returns 8U, 255
// where it belongs.
cv::Mat most_likely(const cv::Mat& evidence, const cv::Mat& picture, const FieldSettings& settings = {});

}  // namespace nido::attention
