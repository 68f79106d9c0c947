#include "nido/vision/picture_filter.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace nido::vision {

double noise_levels(const Image& image) {
  const int width = image.width;
  const int height = image.height;
  if (width < 3 || height < 3) return 0.0;
  std::vector<double> rows;
  const auto green = [&](int x, int y) {
    return static_cast<int>(image.rgb[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                       static_cast<std::size_t>(x)) *
                                          3 +
                                      1]);
  };
  for (int y = 1; y + 1 < height; y += 4) {
    long sum = 0;
    int count = 0;
    for (int x = 1; x + 1 < width; x += 2, ++count) {
      const int corners =
          green(x - 1, y - 1) + green(x + 1, y - 1) + green(x - 1, y + 1) + green(x + 1, y + 1);
      const int sides = green(x, y - 1) + green(x, y + 1) + green(x - 1, y) + green(x + 1, y);
      sum += std::abs(corners - 2 * sides + 4 * green(x, y));
    }
    // the operator makes noise six times as large; sqrt(pi / 2): from mean distance to standard deviation
    rows.push_back(std::sqrt(M_PI / 2) * static_cast<double>(sum) / (6.0 * count));
  }
  const auto middle = rows.begin() + static_cast<std::ptrdiff_t>(rows.size() / 2);
  std::nth_element(rows.begin(), middle, rows.end());
  return *middle;
}

void smooth(Image& image) {
  const auto width = static_cast<std::size_t>(image.width);
  const auto height = static_cast<std::size_t>(image.height);
  if (width < 3 || height < 3) return;
  const std::size_t stride = 3 * width;
  // along rows, times four, then along columns
  std::vector<std::uint16_t> along(stride * height);
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint8_t* const in = image.rgb.data() + y * stride;
    std::uint16_t* const out = along.data() + y * stride;
    for (std::size_t i = 0; i < stride; ++i) {
      const int before = i < 3 ? in[i] : in[i - 3];
      const int after = i + 3 >= stride ? in[i] : in[i + 3];
      out[i] = static_cast<std::uint16_t>(before + 2 * in[i] + after);
    }
  }
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint16_t* const here = along.data() + y * stride;
    const std::uint16_t* const above = y == 0 ? here : here - stride;
    const std::uint16_t* const below = y + 1 == height ? here : here + stride;
    std::uint8_t* const out = image.rgb.data() + y * stride;
    for (std::size_t i = 0; i < stride; ++i)
      out[i] = static_cast<std::uint8_t>((above[i] + 2 * here[i] + below[i] + 8) / 16);
  }
}

}  // namespace nido::vision
