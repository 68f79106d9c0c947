#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// A frame, and what it moves with.
struct Frame {
  std::string name;    // a link of the body (docs/body.md), or what was put
  std::string parent;  // empty: nothing is known that it is fixed to
  bool is_put = false;
};

struct FrameTransform {
  Eigen::Isometry3d X_BaseFrame = Eigen::Isometry3d::Identity();  // m
  std::int64_t stamp_ns = 0;  // robot's time of the encoders, the oldest of them
};

// How old encoders may be.
inline constexpr double kFramesTooOld_s = 0.5;

// Where frames are, seen from each other: the links of the body as its encoders say, and frames that somebody
// has put there, for instance a camera beside the robot or a tool in its hand. Thread-safe.
class IFrameTransforms {
 public:
  virtual ~IFrameTransforms() = default;
  // All of them; parents before what moves with them, but for parents of which nothing is known.
  [[nodiscard]] virtual Result<std::vector<Frame>> frames() const = 0;
  // Pose of `frame` seen from `base`, now. kNotFound for a name that nobody knows, kFailed when nothing
  // connects the two or a board's encoders are older than kFramesTooOld_s.
  [[nodiscard]] virtual Result<FrameTransform> transform(const std::string& base,
                                                         const std::string& frame) const = 0;
  // Fixes a frame to another, or to a name that is not known yet; a frame that was put before goes there.
  // Names are 1 to 64 letters, digits or _ - . / characters. kInvalidArgument, and nothing is changed, for a
  // link of the body, a frame that would move with itself, a pose that is none, and more than 300 frames.
  virtual Status put(const std::string& parent, const std::string& name,
                     const Eigen::Isometry3d& X_ParentFrame) = 0;
  // Forgets a frame that was put. kNotFound for any other.
  virtual Status remove(const std::string& name) = 0;
};

}  // namespace nido
