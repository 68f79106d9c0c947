#pragma once

#include <array>
#include <string>
#include <vector>

#include "nido/report/plot.h"

namespace nido {

// What a plot is drawn from, in pixels, y down: laid out once, written as SVG or painted as a picture.
struct DrawnLine {
  std::vector<std::array<double, 2>> points;
  std::array<int, 3> rgb{};
  double width = 1.0;
  bool dashed = false;
};
struct DrawnDot {
  std::array<double, 2> centre{};
  std::array<int, 3> rgb{};
  double radius = 2.0;
};
struct DrawnBox {
  double x = 0.0;
  double y = 0.0;
  double width = 0.0;
  double height = 0.0;
  std::array<int, 3> rgb{};
};
struct DrawnText {
  double x = 0.0;
  double y = 0.0;  // base line
  std::string text;
  int size_px = 12;
  enum class Anchor { kStart, kMiddle, kEnd } anchor = Anchor::kStart;
  bool upward = false;  // turned a quarter to the left
};
struct Drawing {
  int width = 0;
  int height = 0;
  std::vector<DrawnBox> boxes;
  std::vector<DrawnLine> lines;
  std::vector<DrawnDot> dots;
  std::vector<DrawnText> texts;
};

Drawing lay_out(const Plot& plot);

}  // namespace nido
