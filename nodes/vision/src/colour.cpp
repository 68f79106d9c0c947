#include "nido/vision/colour.h"

#include <algorithm>
#include <cmath>

namespace nido::vision {

Hsv to_hsv(double red, double green, double blue) {
  const double top = std::max({red, green, blue});
  const double span = top - std::min({red, green, blue});
  Hsv hsv;
  hsv.value = top;
  hsv.saturation = top > 0 ? span / top : 0;
  if (span > 0) {
    if (top == red) {
      hsv.hue_deg = 60 * (green - blue) / span;
    } else if (top == green) {
      hsv.hue_deg = 120 + 60 * (blue - red) / span;
    } else {
      hsv.hue_deg = 240 + 60 * (red - green) / span;
    }
    if (hsv.hue_deg < 0) hsv.hue_deg += 360;
  }
  return hsv;
}

double hue_distance_deg(double a_deg, double b_deg) {
  const double d = std::abs(std::remainder(a_deg - b_deg, 360.0));
  return d;
}

ColourTable::ColourTable(const std::vector<ColourModel>& colours) : table_(std::size_t{1} << 18, kNone) {
  for (std::size_t i = 0; i < table_.size(); ++i) {
    // middle of the 4 stored values that share an entry
    const auto channel = [&](unsigned shift) {
      return (static_cast<double>((i >> shift) & 63U) * 4 + 1.5) / 255.0;
    };
    const Hsv hsv = to_hsv(channel(12), channel(6), channel(0));
    double best = 1.0;
    for (std::size_t c = 0; c < colours.size(); ++c) {
      const ColourModel& colour = colours[c];
      if (hsv.value < colour.value_min || hsv.saturation < colour.saturation_min ||
          hsv.saturation > colour.saturation_max) {
        continue;
      }
      const double distance = hue_distance_deg(hsv.hue_deg, colour.hue_deg) / colour.hue_tolerance_deg;
      if (distance < best) {
        best = distance;
        table_[i] = static_cast<std::uint8_t>(c);
      }
    }
  }
}

}  // namespace nido::vision
