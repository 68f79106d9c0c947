#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/report/report.h"

namespace nido {

// A colour picture as it comes from a camera: rows from top to bottom, red, green, blue.
struct CameraFrame {
  std::int64_t stamp_ns = 0;
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;  // 3 * width * height
};

// Something that vision found in the two eyes. Boxes: x, y, width, height, px; empty ones are not drawn.
struct FoundBox {
  std::string label;
  std::array<double, 4> left{};
  std::array<double, 4> right{};
};

// Keeps what the cameras and vision said last and writes pictures of a moment, with what vision found drawn
// in. Not thread-safe.
class StagePictures {
 public:
  enum class Camera { kLeft, kRight, kOutside };

  explicit StagePictures(std::string folder) : folder_(std::move(folder)) {}

  // A frame whose size does not fit its bytes is ignored.
  void frame(Camera camera, CameraFrame frame);
  void found(std::int64_t stamp_ns, std::vector<FoundBox> objects);
  void hand(const FoundBox& hand, bool visible);

  // Writes stage-NN-NAME-{left,right,outside}.png of the cameras that gave a frame; NN counts up. Eyes: the
  // frame that vision looked at last, if it is still kept, else the newest. What cannot be written is left
  // out and told.
  std::vector<Picture> capture(const std::string& name, std::vector<std::string>& troubles);

 private:
  [[nodiscard]] const CameraFrame* choose(Camera camera) const;
  std::string folder_;
  int number_ = 0;
  std::array<std::deque<CameraFrame>, 3> frames_;
  std::int64_t found_ns_ = 0;
  std::vector<FoundBox> objects_;
  FoundBox hand_;
  bool hand_visible_ = false;
};

}  // namespace nido
