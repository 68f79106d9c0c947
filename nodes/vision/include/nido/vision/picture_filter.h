#pragma once

#include "nido/interfaces/camera.h"

namespace nido::vision {

// Standard deviation of the noise in a picture, levels of 255 a channel: from what no smooth surface and no
// edge explains (Immerkaer's operator), the median over the picture's rows. About 1 for a picture without
// noise but with texture. Stateless, thread-safe.
[[nodiscard]] double noise_levels(const Image& image);

// Smooths a picture in place, each pixel with its neighbours (1 2 1 along rows and columns): noise becomes
// three eighths of what it was.
void smooth(Image& image);

}  // namespace nido::vision
