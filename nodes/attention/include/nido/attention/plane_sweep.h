#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "nido/vision/stereo_fit.h"

namespace nido::attention {

// How well both pictures agree if what is seen lay at certain distances. Plane k stands across the left eye's
// optical axis at inverse depth inverse_depth(k); from one to the next a point moves by one pixel of the half
// size pictures. Plane 0 goes through the point of fixation: there the disparity is zero.
struct PlaneSweep {
  cv::Rect roi;                // of the half size left picture
  double inverse_depth_0 = 0;  // of plane 0, 1/m
  double step = 0;             // of inverse depth from plane to plane, 1/m
  int first = 0;               // number of costs[0]: below zero is farther than the fixation point
  std::vector<cv::Mat> costs;  // 32F, roi's size: mean difference of colour over a window, 0..kCostLimit

  [[nodiscard]] double inverse_depth(double plane) const { return inverse_depth_0 + step * plane; }
  [[nodiscard]] const cv::Mat& cost(int plane) const {
    return costs[static_cast<std::size_t>(plane - first)];
  }
  [[nodiscard]] int last() const { return first + static_cast<int>(costs.size()) - 1; }
};

inline constexpr float kCostLimit = 40;  // differences beyond say no more (grey levels)

// `left_half`, `right_half`: 8UC3, half the size of the eyes' cameras. Planes behind the horizon are left
// out. `roi` inside the left picture.
PlaneSweep sweep(const cv::Mat& left_half, const cv::Mat& right_half, const vision::EyePair& eyes,
                 const cv::Rect& roi, double inverse_depth_0, int first_plane, int last_plane);

// Of the plane on which the masked pixels (8U, roi's size) agree best, between `lowest` and `highest`, to a
// fraction; planes are numbers as above.
double best_plane(const PlaneSweep& planes, const cv::Mat& mask, int lowest, int highest);

}  // namespace nido::attention
