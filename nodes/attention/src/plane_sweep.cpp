#include "nido/attention/plane_sweep.h"

#include <Eigen/LU>
#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace nido::attention {
namespace {

constexpr int kWindow_px = 7;          // of the half size picture
constexpr double kPlain_grey2 = 30.0;  // variance of a window that counts as plain

// Camera matrix of the half size picture in OpenCV's pixels, whose centres are whole numbers.
Eigen::Matrix3d half_camera(const PinholeCamera& camera) {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = camera.fx_px / 2;
  K(1, 1) = camera.fy_px / 2;
  K(0, 2) = camera.cx_px / 2 - 0.5;
  K(1, 2) = camera.cy_px / 2 - 0.5;
  return K;
}

// Averages costs over windows that follow the picture's edges: He, Sun, Tang: Guided image filtering. TPAMI
// 2013; for costs: Hosni et al.: Fast cost-volume filtering. TPAMI 2013. A plain window would spread what a
// surface says over its edge.
class EdgeKeeping {
 public:
  explicit EdgeKeeping(const cv::Mat& picture) {
    cv::transform(picture, guide_, cv::Matx13f(1.F / 3, 1.F / 3, 1.F / 3));
    guide_.convertTo(guide_, CV_32F);
    mean_ = window(guide_);
    variance_ = window(guide_.mul(guide_)) - mean_.mul(mean_) + kPlain_grey2;
  }
  [[nodiscard]] cv::Mat operator()(const cv::Mat& cost) const {
    const cv::Mat mean = window(cost);
    cv::Mat slope;
    cv::divide(window(guide_.mul(cost)) - mean_.mul(mean), variance_, slope);
    const cv::Mat offset = mean - slope.mul(mean_);
    return window(slope).mul(guide_) + window(offset);
  }

 private:
  static cv::Mat window(const cv::Mat& from) {
    cv::Mat to;
    cv::blur(from, to, {kWindow_px, kWindow_px}, {-1, -1}, cv::BORDER_REPLICATE);
    return to;
  }
  cv::Mat guide_;
  cv::Mat mean_;
  cv::Mat variance_;
};

}  // namespace

PlaneSweep sweep(const cv::Mat& left_half, const cv::Mat& right_half, const vision::EyePair& eyes,
                 const cv::Rect& roi, double inverse_depth_0, int first_plane, int last_plane) {
  const Eigen::Isometry3d X_RightLeft = eyes[1].X_RootCamera.inverse() * eyes[0].X_RootCamera;
  const Eigen::Matrix3d K_left_inverse = half_camera(eyes[0].camera).inverse();
  const Eigen::Matrix3d K_right = half_camera(eyes[1].camera);
  PlaneSweep planes;
  planes.roi = roi;
  planes.inverse_depth_0 = inverse_depth_0;
  planes.step = 2 / (eyes[0].camera.fx_px * X_RightLeft.translation().norm());
  // nothing lies behind the horizon
  planes.first = first_plane;
  while (planes.first < 0 && planes.inverse_depth(planes.first) < 0) ++planes.first;

  const cv::Mat here = left_half(roi);
  const EdgeKeeping smooth(here);
  cv::Mat warped;
  cv::Mat difference;
  for (int k = planes.first; k <= last_plane; ++k) {
    // where the points of the plane that the left picture's pixels show are seen by the right eye
    Eigen::Matrix3d H = X_RightLeft.linear();
    H.col(2) += X_RightLeft.translation() * planes.inverse_depth(k);
    H = K_right * H * K_left_inverse;
    H.col(2) += H.col(0) * roi.x + H.col(1) * roi.y;
    cv::Matx33d map;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) map(r, c) = H(r, c);
    }
    cv::warpPerspective(right_half, warped, map, roi.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                        cv::BORDER_REPLICATE);
    cv::absdiff(here, warped, difference);
    cv::Mat cost;
    cv::transform(difference, cost, cv::Matx13f(1.F / 3, 1.F / 3, 1.F / 3));
    cost.convertTo(cost, CV_32F);
    cv::min(cost, kCostLimit, cost);
    planes.costs.push_back(smooth(cost));
  }
  return planes;
}

double best_plane(const PlaneSweep& planes, const cv::Mat& mask, int lowest, int highest) {
  lowest = std::max(lowest, planes.first);
  highest = std::min(highest, planes.last());
  std::vector<double> sums;
  for (int k = lowest; k <= highest; ++k) sums.push_back(cv::mean(planes.cost(k), mask)[0]);
  if (sums.empty()) return 0;
  const auto best = std::min_element(sums.begin(), sums.end());
  const double plane = lowest + static_cast<double>(best - sums.begin());
  if (best == sums.begin() || best + 1 == sums.end()) return plane;
  // differences grow linearly beside the best match: the peak of a roof, not of a parabola
  const double before = *(best - 1) - *best;
  const double after = *(best + 1) - *best;
  const double larger = std::max(before, after);
  return larger > 1e-6 ? plane + 0.5 * (before - after) / larger : plane;
}

}  // namespace nido::attention
