#pragma once

#include <cstdint>
#include <string>

#include "nido/interfaces/result.h"

namespace nido {

// A picture as JPEG. `rows`: height rows of `step` bytes each, of which 3 * width are pixels (red, green,
// blue; or blue, green, red) or width are grey. kInvalidArgument when the sizes do not fit each other.
struct PictureView {
  const std::uint8_t* bytes = nullptr;
  std::size_t size = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t step = 0;
  std::string encoding;  // "rgb8", "bgr8", "mono8"
};
Result<std::string> jpeg_of(const PictureView& picture, int quality);

}  // namespace nido
