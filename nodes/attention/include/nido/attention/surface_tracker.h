#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "nido/attention/appearance.h"
#include "nido/attention/markov_field.h"
#include "nido/attention/plane_sweep.h"
#include "nido/middleware/time.h"

namespace nido::attention {

// Who decides which pixels belong to the surface.
enum class Method {
  kField,      // the spatiotemporal zero disparity filter, made whole by a Markov random field
  kThreshold,  // for comparison: the disparity alone, pixel by pixel
  kColour,     // for comparison: the colours that lay in the middle of the picture at the start
};

struct SurfaceSettings {
  Method method = Method::kField;
  double depth_m = 0.035;  // before and behind the fixated point: disparities in there count as zero
  int reach = 12;          // disparities beyond the band that compete
  double disparity = 1.0;  // weights of the three witnesses, as half log odds
  double last_segment = 0.5;
  double appearance = 0.7;
  FieldSettings field;
};

// The surface that the eyes rest on, in one pair of pictures.
struct Surface {
  Time stamp;
  cv::Mat mask;                                         // 8U 0/255, of the left picture's size
  cv::Mat threshold;                                    // the same by disparity alone, for comparison
  Eigen::Vector2d p_Left_px = Eigen::Vector2d::Zero();  // the segment's centre in the left picture
  Eigen::Vector2d p_Right_px = Eigen::Vector2d::Zero();
  Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();  // that point on the surface, filtered
  Eigen::Vector3d v_Root_m_s = Eigen::Vector3d::Zero();
  double confidence = 0;  // 0..1: how sure the segment's pixels are of themselves
};

// Finds the surface at fixation and holds on to it, by coherence alone: both eyes agree there at a disparity
// about zero, and the last segment, moved along, agrees with what is seen now. Knows nothing of the thing's
// colour, shape or motion. One thread.
class SurfaceTracker {
 public:
  explicit SurfaceTracker(const SurfaceSettings& settings) : settings_(settings) {}
  // Forgets; the next pair starts with the nearest surface in the middle of the left picture.
  void start();
  // Pictures: 8UC3 of the cameras' size, taken at one moment. Nothing when no surface is found; after half a
  // second without one it starts again.
  std::optional<Surface> step(Time stamp, const cv::Mat& left, const cv::Mat& right,
                              const vision::EyePair& eyes);

 private:
  struct Guess {
    Eigen::Vector3d p_Root_m;
    Eigen::Vector2d p_Left_px;
    double inverse_depth = 0;
    cv::Rect roi;  // where the segment may lie; even corners
  };
  [[nodiscard]] std::optional<Guess> guess(Time stamp, const vision::EyePair& eyes) const;
  void acquire(const cv::Mat& left_half, const cv::Mat& right_half, const vision::EyePair& eyes,
               Guess& guess) const;
  // Half log odds of the last segment, moved to where it fits now; 32F of the roi's size.
  cv::Mat last_segment(const cv::Mat& left, const Guess& guess) const;

  SurfaceSettings settings_;
  Appearance appearance_;
  bool tracking_ = false;
  int missed_ = 0;
  // of the last pair
  Time stamp_;
  cv::Mat left_;
  cv::Mat mask_;
  Eigen::Vector2d p_Left_px_ = Eigen::Vector2d::Zero();
  double inverse_depth_ = 0;
  Eigen::Vector3d p_Root_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_Root_m_s_ = Eigen::Vector3d::Zero();
};

}  // namespace nido::attention
