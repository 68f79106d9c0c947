#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nido/interfaces/camera.h"
#include "nido/interfaces/result.h"

namespace nido {

// What lies behind the centre of each pixel; rows from top to bottom without padding.
struct DepthPicture {
  std::int64_t stamp_ns = 0;  // when it was taken, of the robot's clock
  int width = 0;              // pixels
  int height = 0;             // pixels
  std::vector<float> z_m;     // along the optical axis; 0: nothing there
  // What it belongs to: place in labels() plus one; 0: the room or nothing.
  std::vector<std::uint16_t> label;
};

// A camera that knows how far things are and which is which: for experiments, never for a node that stands
// for the robot. Thread-safe.
class IDepthCamera {
 public:
  virtual ~IDepthCamera() = default;
  // What is there now, into `picture`, whose storage is reused; on failure it keeps what it had.
  virtual Status measure(DepthPicture& picture) = 0;
  // Names of links and objects, as they are now.
  [[nodiscard]] virtual Result<std::vector<std::string>> labels() const = 0;
  [[nodiscard]] virtual Result<CameraInfo> info() const = 0;
};

}  // namespace nido
