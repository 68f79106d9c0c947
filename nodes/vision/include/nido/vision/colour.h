#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace nido::vision {

// Hue, saturation and value of a pixel as it is stored.
struct Hsv {
  double hue_deg = 0;     // 0..360
  double saturation = 0;  // 0..1
  double value = 0;       // 0..1
};
[[nodiscard]] Hsv to_hsv(double red, double green, double blue);  // 0..1 each
// Difference of two hues, 0..180 deg.
[[nodiscard]] double hue_distance_deg(double a_deg, double b_deg);

// What pixels of one colour look like under any light of the room: shade changes the value, hardly hue or
// saturation.
struct ColourModel {
  std::string name;
  double hue_deg = 0;
  double hue_tolerance_deg = 10;
  double saturation_min = 0.4;
  double saturation_max = 1.0;
  double value_min = 0.1;
};

// Pixel colour -> number of the colour model that it fits best, by table. Immutable, so thread-safe.
class ColourTable {
 public:
  static constexpr std::uint8_t kNone = 255;
  // At most 200 colours.
  explicit ColourTable(const std::vector<ColourModel>& colours);
  [[nodiscard]] std::uint8_t classify(std::uint8_t red, std::uint8_t green, std::uint8_t blue) const {
    return table_[(static_cast<std::size_t>(red >> 2) << 12) | (static_cast<std::size_t>(green >> 2) << 6) |
                  (blue >> 2)];
  }

 private:
  std::vector<std::uint8_t> table_;  // 6 bits a channel
};

}  // namespace nido::vision
