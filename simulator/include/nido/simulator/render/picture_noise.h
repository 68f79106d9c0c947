#pragma once

#include <cstdint>
#include <vector>

#include "nido/interfaces/camera.h"
#include "nido/interfaces/result.h"

namespace nido::sim {

// What a real camera adds to an ideal picture.
struct NoiseOptions {
  double blur_px = 0;       // standard deviation of the lens's blur, 0..5 pixels
  double noise_levels = 0;  // standard deviation of each channel of each pixel, 0..64 of 255 levels
  std::uint64_t seed = 1;   // give every camera its own
};

// Adds blur and noise to the pictures of one camera. The same seed, moment and picture give the same bytes,
// whatever pictures were taken before. Not thread-safe.
class PictureNoise {
 public:
  // Refuses values outside their ranges, naming the value.
  static Result<PictureNoise> create(const NoiseOptions& options);

  // Changes the picture in place: first the lens, then the noise. `moment` says which picture of the camera
  // it is: each has grain of its own.
  void apply(Image& picture, std::uint64_t moment);

 private:
  explicit PictureNoise(const NoiseOptions& options);
  void blur(Image& picture);

  NoiseOptions options_;
  std::vector<float> kernel_;      // one side of the blur, the middle first; empty without blur
  std::vector<float> row_buffer_;  // of the blur
};

}  // namespace nido::sim
