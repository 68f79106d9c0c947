#pragma once

#include <cstdint>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// A colour picture. Rows from top to bottom without padding, three bytes a pixel: red, green, blue.
struct Image {
  std::int64_t stamp_ns = 0;  // when it was taken, of the robot's clock
  int width = 0;              // pixels
  int height = 0;             // pixels
  std::vector<std::uint8_t> rgb;
};

// Pinhole model: a point (x, y, z) of the optical frame (z forward, x right and y down in the image) is seen
// at u = fx x/z + cx, v = fy y/z + cy in continuous image coordinates, where u = 0 is the image's left edge
// and the centre of pixel (column i, row j) lies at (i + 0.5, j + 0.5).
struct CameraInfo {
  int width = 0;   // pixels
  int height = 0;  // pixels
  double fx_px = 0;
  double fy_px = 0;
  double cx_px = 0;
  double cy_px = 0;
  std::vector<double> distortion;  // k1 k2 t1 t2 k3 of the plumb-bob model; empty: none
};

// A camera. Thread-safe.
class ICamera {
 public:
  virtual ~ICamera() = default;
  // The newest picture into `image`, whose storage is reused; on failure it keeps what it had. Its size is
  // that of info(). Taking a picture may cost milliseconds. A camera on the far side fails with kTimeout
  // before its first picture has come.
  virtual Status grab(Image& image) = 0;
  [[nodiscard]] virtual Result<CameraInfo> info() const = 0;
};

// A camera that can be told when to take its picture, and makes it while others work: an option of ICamera.
// Thread-safe.
class IShutter {
 public:
  virtual ~IShutter() = default;
  // Takes what is seen now. The next grab() gives this picture and waits until it is made. Does not wait
  // itself.
  virtual Status open_shutter() = 0;
};

}  // namespace nido
