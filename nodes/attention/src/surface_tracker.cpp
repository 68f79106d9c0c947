#include "nido/attention/surface_tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "nido/attention/background.h"

namespace nido::attention {
namespace {

constexpr int kStart_px = 80;   // half the size of the window at the start
constexpr int kMargin_px = 28;  // that a segment may grow or move by from pair to pair
constexpr int kSeed_px = 22;    // the nearest surface within this of the middle is attended to
constexpr int kSearch_px = 4;   // half size pixels that the last segment is shifted by to fit
constexpr double kSmallest_px = 60;
constexpr int kMissed = 15;
constexpr double kDisparityScale = 2.5;   // grey levels by which one match must be better to count
constexpr double kBackgroundWidth = 0.9;  // planes this near to the background are the background's
constexpr double kDoubt = 0.1;            // against belonging, where nothing speaks
constexpr double kOutside = -0.6;         // what the last segment says against pixels outside of it
constexpr int kClear_px = 6;              // half size pixels between segment and background
constexpr int kNeutral = 1;               // disparities beside the band that say nothing
constexpr double kSure = 1.5;             // grey levels by which a match must beat others to be believed
constexpr double kAlpha = 0.7;            // of the filter of the fixated point
constexpr double kBeta = 0.25;

cv::Rect even(const cv::Rect& r, const cv::Size& size) {
  const int x0 = std::clamp(r.x, 0, size.width) / 2 * 2;
  const int y0 = std::clamp(r.y, 0, size.height) / 2 * 2;
  const int x1 = std::clamp(r.x + r.width + 1, 0, size.width) / 2 * 2;
  const int y1 = std::clamp(r.y + r.height + 1, 0, size.height) / 2 * 2;
  return {x0, y0, std::max(0, x1 - x0), std::max(0, y1 - y0)};
}

cv::Rect half(const cv::Rect& r) { return {r.x / 2, r.y / 2, r.width / 2, r.height / 2}; }

cv::Mat halved(const cv::Mat& picture) {
  cv::Mat small;
  cv::resize(picture, small, {picture.cols / 2, picture.rows / 2}, 0, 0, cv::INTER_AREA);
  return small;
}

// By how much the best plane of the band agrees better than the best one outside; -1.5..1.5. Where a flat
// background goes on behind the surface, its plane is one of those outside, also within the band.
cv::Mat disparity_evidence(const PlaneSweep& planes, int band, const std::optional<Background>& background) {
  cv::Mat evidence(planes.roi.size(), CV_32F);
  const std::size_t count = planes.costs.size();
  std::vector<const float*> rows(count);
  for (int y = 0; y < evidence.rows; ++y) {
    for (std::size_t k = 0; k < count; ++k) rows[k] = planes.costs[k].ptr<float>(y);
    for (int x = 0; x < evidence.cols; ++x) {
      const double behind = background ? background->plane(x, y) : -1000;
      float inside = kCostLimit;
      float outside = kCostLimit;
      for (std::size_t k = 0; k < count; ++k) {
        const int plane = planes.first + static_cast<int>(k);
        // nothing is farther than the background
        const bool is_background = plane <= behind + kBackgroundWidth;
        // what is just beyond the band may be the surface as well: not a witness
        if (!is_background && std::abs(plane) > band && std::abs(plane) <= band + kNeutral) continue;
        float& best = !is_background && std::abs(plane) <= band ? inside : outside;
        best = std::min(best, rows[k][x]);
      }
      evidence.at<float>(y, x) =
          std::clamp((outside - inside) / static_cast<float>(kDisparityScale), -1.5F, 1.5F);
    }
  }
  return evidence;
}

// The connected part of a mask that shares most with `where` (32F weights); empty when none does.
cv::Mat part_at(const cv::Mat& mask, const cv::Mat& where) {
  cv::Mat labels;
  const int count = cv::connectedComponents(mask, labels, 4, CV_32S);
  std::vector<double> shares(static_cast<std::size_t>(count), 0.0);
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      shares[static_cast<std::size_t>(labels.at<int>(y, x))] += where.at<float>(y, x);
    }
  }
  shares[0] = 0;
  const auto best = std::max_element(shares.begin(), shares.end());
  if (!(*best > 0)) return {};
  return labels == static_cast<int>(best - shares.begin());
}

void fill_holes(cv::Mat& mask) {
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(mask.clone(), outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  cv::drawContours(mask, outlines, -1, 255, cv::FILLED);
}

// A hill of height 1 around a point.
cv::Mat hill(const cv::Size& size, const Eigen::Vector2d& middle_px, double sigma_px) {
  cv::Mat out(size, CV_32F);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double square = std::pow(x + 0.5 - middle_px.x(), 2) + std::pow(y + 0.5 - middle_px.y(), 2);
      out.at<float>(y, x) = static_cast<float>(std::exp(-square / (2 * sigma_px * sigma_px)));
    }
  }
  return out;
}

cv::Mat disc(const cv::Size& size, const Eigen::Vector2d& middle_px, int radius_px) {
  cv::Mat out = cv::Mat::zeros(size, CV_8U);
  cv::circle(out,
             {static_cast<int>(std::lround(middle_px.x())), static_cast<int>(std::lround(middle_px.y()))},
             radius_px, 255, cv::FILLED);
  return out;
}

}  // namespace

void SurfaceTracker::start() {
  tracking_ = false;
  missed_ = 0;
  appearance_.forget();
}

std::optional<SurfaceTracker::Guess> SurfaceTracker::guess(Time stamp, const vision::EyePair& eyes) const {
  const PinholeCamera& camera = eyes[0].camera;
  const cv::Size size(camera.width_px, camera.height_px);
  Guess g;
  if (!tracking_) {
    // the point of fixation: where the optical axes meet
    g.p_Left_px = {camera.cx_px, camera.cy_px};
    const auto met = triangulate(
        ray_of_pixel(camera, eyes[0].X_RootCamera, g.p_Left_px),
        ray_of_pixel(eyes[1].camera, eyes[1].X_RootCamera, {eyes[1].camera.cx_px, eyes[1].camera.cy_px}));
    const double depth_m = met ? (eyes[0].X_RootCamera.inverse() * met->p_m).z() : 0.45;
    g.inverse_depth = 1 / std::clamp(depth_m, 0.15, 1.5);
    g.roi = cv::Rect(static_cast<int>(camera.cx_px) - kStart_px, static_cast<int>(camera.cy_px) - kStart_px,
                     2 * kStart_px, 2 * kStart_px);
  } else {
    g.p_Root_m = p_Root_m_ + v_Root_m_s_ * Time{stamp.ns - stamp_.ns}.seconds();
    const Eigen::Vector3d p_Left_m = eyes[0].X_RootCamera.inverse() * g.p_Root_m;
    const auto px = camera.project(p_Left_m);
    if (!px || p_Left_m.z() < 0.05) return std::nullopt;
    g.p_Left_px = *px;
    g.inverse_depth = 1 / p_Left_m.z();
    const cv::Rect box = cv::boundingRect(mask_);
    const Eigen::Vector2d shift = g.p_Left_px - p_Left_px_;
    g.roi = cv::Rect(box.x + static_cast<int>(std::lround(shift.x())) - kMargin_px,
                     box.y + static_cast<int>(std::lround(shift.y())) - kMargin_px,
                     box.width + 2 * kMargin_px, box.height + 2 * kMargin_px);
  }
  g.roi = even(g.roi, size);
  if (g.roi.width < 16 || g.roi.height < 16) return std::nullopt;
  return g;
}

// The nearest surface that a fair share of the middle's pixels is sure of.
void SurfaceTracker::acquire(const cv::Mat& left_half, const cv::Mat& right_half, const vision::EyePair& eyes,
                             Guess& guess) const {
  const int r = settings_.reach;
  const PlaneSweep planes = sweep(left_half, right_half, eyes, half(guess.roi), guess.inverse_depth, -r, r);
  const Eigen::Vector2d middle = (guess.p_Left_px - Eigen::Vector2d(guess.roi.x, guess.roi.y)) / 2;
  const cv::Mat seed = disc(planes.roi.size(), middle, kSeed_px / 2);
  const cv::Mat sure_of = sure_planes(planes, kSure);
  std::vector<int> votes(planes.costs.size(), 0);
  int sure = 0;
  for (int y = 0; y < seed.rows; ++y) {
    for (int x = 0; x < seed.cols; ++x) {
      const float plane = sure_of.at<float>(y, x);
      if (seed.at<std::uint8_t>(y, x) == 0 || !std::isfinite(plane)) continue;
      ++votes[static_cast<std::size_t>(static_cast<int>(plane) - planes.first)];
      ++sure;
    }
  }
  if (sure < 20) return;  // nothing but plain colour: the fixation point is as good a guess as any
  int near = 0;
  for (std::size_t k = votes.size(); k-- > 0;) {
    near += votes[k];
    if (near * 5 < sure * 2) continue;
    guess.inverse_depth = planes.inverse_depth(planes.first + static_cast<int>(k));
    return;
  }
}

cv::Mat SurfaceTracker::last_segment(const cv::Mat& left, const Guess& g) const {
  // the segment in half size, where the guess says; then shifted a little to where it agrees best
  const double scale = g.inverse_depth / std::max(inverse_depth_, 1e-6);
  const auto moved = [&](const cv::Mat& from, const Eigen::Vector2d& to_px, int border) {
    // OpenCV's pixel centres are whole numbers
    const Eigen::Vector2d a = p_Left_px_ - Eigen::Vector2d(0.5, 0.5);
    const Eigen::Vector2d b = to_px - Eigen::Vector2d(g.roi.x + 0.5, g.roi.y + 0.5);
    const cv::Matx23d map(scale, 0, b.x() - scale * a.x(), 0, scale, b.y() - scale * a.y());
    cv::Mat out;
    cv::warpAffine(from, out, map, g.roi.size(), cv::INTER_LINEAR, border);
    return out;
  };
  const cv::Mat now = halved(left(g.roi));
  const cv::Mat before = halved(moved(left_, g.p_Left_px, cv::BORDER_REPLICATE));
  const cv::Mat segment = halved(moved(mask_, g.p_Left_px, cv::BORDER_CONSTANT));
  double best = 1e9;
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  for (int dy = -kSearch_px; dy <= kSearch_px; ++dy) {
    for (int dx = -kSearch_px; dx <= kSearch_px; ++dx) {
      const cv::Rect from = cv::Rect({0, 0}, now.size()) & cv::Rect({-dx, -dy}, now.size());
      const cv::Rect to(from.x + dx, from.y + dy, from.width, from.height);
      const cv::Mat on = segment(from) > 127;
      cv::Mat difference;
      cv::absdiff(before(from), now(to), difference);
      const cv::Scalar mean = cv::mean(difference, on);
      // plain surfaces fit everywhere: stay
      const double cost = (mean[0] + mean[1] + mean[2]) / 3 + 0.15 * std::hypot(dx, dy);
      if (cost < best) {
        best = cost;
        shift = {2.0 * dx, 2.0 * dy};
      }
    }
  }
  const Eigen::Vector2d to_px = g.p_Left_px + shift;
  cv::Mat belongs;
  moved(mask_, to_px, cv::BORDER_CONSTANT).convertTo(belongs, CV_32F, 2.0 / 255, -1);
  cv::GaussianBlur(belongs, belongs, {0, 0}, 2.5, 2.5, cv::BORDER_REPLICATE);
  // it says little where the pictures differ
  cv::Mat difference;
  cv::absdiff(moved(left_, to_px, cv::BORDER_REPLICATE), left(g.roi), difference);
  cv::transform(difference, difference, cv::Matx13f(1.F / 3, 1.F / 3, 1.F / 3));
  cv::Mat agreement;
  difference.convertTo(agreement, CV_32F, -1.0 / 14);
  cv::blur(agreement, agreement, {5, 5});
  cv::exp(agreement, agreement);
  cv::max(belongs, kOutside, belongs);
  return belongs.mul(0.3 + 0.7 * agreement);
}

std::optional<Surface> SurfaceTracker::step(Time stamp, const cv::Mat& left, const cv::Mat& right,
                                            const vision::EyePair& eyes) {
  const cv::Mat left_half = halved(left);
  const cv::Mat right_half = halved(right);
  auto found = guess(stamp, eyes);
  if (!found) {
    start();
    return std::nullopt;
  }
  Guess& g = *found;
  if (!tracking_) acquire(left_half, right_half, eyes, g);
  // the band of disparities that a surface of this depth spans here
  const double step = 2 / (eyes[0].camera.fx_px *
                           (eyes[1].X_RootCamera.translation() - eyes[0].X_RootCamera.translation()).norm());
  const int band = std::clamp(
      static_cast<int>(std::lround(settings_.depth_m * g.inverse_depth * g.inverse_depth / step)), 1, 8);
  const int most = band + settings_.reach;
  const PlaneSweep planes = sweep(left_half, right_half, eyes, half(g.roi), g.inverse_depth, -most, most);

  // the witnesses
  const cv::Mat picture = left(g.roi);
  const Eigen::Vector2d middle = g.p_Left_px - Eigen::Vector2d(g.roi.x, g.roi.y);
  const cv::Mat where = tracking_ ? last_segment(left, g) : hill(g.roi.size(), middle, 16) * 2.2 - 1.0;
  cv::Mat where_half;
  cv::resize(where, where_half, planes.roi.size(), 0, 0, cv::INTER_AREA);
  // well outside: what the last segment missed of the thing must not be taken for the background
  cv::Mat outside;
  cv::erode(where_half < -0.1, outside,
            cv::getStructuringElement(cv::MORPH_RECT, {2 * kClear_px + 1, 2 * kClear_px + 1}));
  const auto background = find_background(sure_planes(planes, kSure), outside, middle / 2, 0);
  cv::Mat disparity;
  cv::resize(disparity_evidence(planes, band, background), disparity, g.roi.size(), 0, 0, cv::INTER_LINEAR);
  cv::Mat disparity_alone;  // without the background: what the comparison goes by
  cv::resize(disparity_evidence(planes, band, std::nullopt), disparity_alone, g.roi.size(), 0, 0,
             cv::INTER_LINEAR);
  cv::Mat at_segment;  // weights of where the surface is expected
  cv::max(where, 0, at_segment);

  cv::Mat mask;
  cv::Mat field;
  if (settings_.method == Method::kColour) {
    if (appearance_.empty()) {
      const cv::Mat seed = disc(left.size(), g.p_Left_px, 9);
      appearance_.learn(left, seed, ~disc(left.size(), g.p_Left_px, 40), 0);
    }
    field = appearance_.log_odds(picture, 2);
  } else if (settings_.method == Method::kThreshold) {
    field = disparity_alone - 0.1;
  } else {
    const cv::Mat evidence = settings_.disparity * disparity + settings_.last_segment * where +
                             settings_.appearance * appearance_.log_odds(picture, 2.5) - kDoubt;
    field = evidence;
    mask = most_likely(evidence, picture, settings_.field);
  }
  mask = part_at(mask.empty() ? cv::Mat(field > 0) : mask, at_segment);
  if (!mask.empty()) fill_holes(mask);
  const double area_px = mask.empty() ? 0 : cv::countNonZero(mask);
  if (area_px < kSmallest_px) {
    if (++missed_ > kMissed) start();
    return std::nullopt;
  }
  missed_ = 0;

  Surface surface;
  surface.stamp = stamp;
  surface.mask = cv::Mat::zeros(left.size(), CV_8U);
  mask.copyTo(surface.mask(g.roi));
  surface.threshold = cv::Mat::zeros(left.size(), CV_8U);
  if (cv::Mat part = part_at(disparity_alone > 0.1, at_segment); !part.empty())
    part.copyTo(surface.threshold(g.roi));
  const cv::Moments moments = cv::moments(mask, true);
  surface.p_Left_px = {g.roi.x + moments.m10 / moments.m00 + 0.5, g.roi.y + moments.m01 / moments.m00 + 0.5};

  // its depth: where most of it agrees
  cv::Mat mask_half;
  cv::resize(mask, mask_half, planes.roi.size(), 0, 0, cv::INTER_AREA);
  const double plane = best_plane(planes, mask_half > 127, -band - 1, band + 1);
  const double inverse_depth = planes.inverse_depth(plane);
  const PinholeCamera& camera = eyes[0].camera;
  const Eigen::Vector3d ray((surface.p_Left_px.x() - camera.cx_px) / camera.fx_px,
                            (surface.p_Left_px.y() - camera.cy_px) / camera.fy_px, 1);
  const Eigen::Vector3d seen_Root_m =
      eyes[0].X_RootCamera * Eigen::Vector3d(ray / std::max(inverse_depth, 0.3));
  if (tracking_) {
    const double dt_s = std::max(Time{stamp.ns - stamp_.ns}.seconds(), 1e-3);
    const Eigen::Vector3d off_m = seen_Root_m - g.p_Root_m;
    p_Root_m_ = g.p_Root_m + kAlpha * off_m;
    v_Root_m_s_ += kBeta / dt_s * off_m;
    if (v_Root_m_s_.norm() > 1.0) v_Root_m_s_ *= 1.0 / v_Root_m_s_.norm();
  } else {
    p_Root_m_ = seen_Root_m;
    v_Root_m_s_.setZero();
  }
  surface.p_Root_m = p_Root_m_;
  surface.v_Root_m_s = v_Root_m_s_;
  if (const auto px = eyes[1].camera.project(eyes[1].X_RootCamera.inverse() * seen_Root_m))
    surface.p_Right_px = *px;
  surface.confidence = std::clamp(cv::mean(field, mask)[0], 0.0, 1.0);

  // what the next pair may rely on
  if (settings_.method == Method::kField) {
    cv::Mat inner;
    cv::Mat outer;
    const cv::Mat brush = cv::getStructuringElement(cv::MORPH_ELLIPSE, {5, 5});
    cv::erode(mask, inner, brush, {-1, -1}, 1, cv::BORDER_CONSTANT, 0);
    cv::dilate(mask, outer, brush);
    // what disparity denies is not learned
    appearance_.learn(picture, inner & (disparity > -0.4), ~outer & (disparity < 0.3), tracking_ ? 0.85 : 0);
  }
  tracking_ = true;
  stamp_ = stamp;
  left.copyTo(left_);
  mask_ = surface.mask;
  p_Left_px_ = surface.p_Left_px;
  inverse_depth_ = inverse_depth;
  return surface;
}

}  // namespace nido::attention
