#pragma once

#include <array>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// One line or cloud of points in a plot. A point that is not finite leaves a gap.
struct Series {
  std::string name;
  std::vector<std::array<double, 2>> points = {};
  bool line = true;     // joined points, else dots
  bool dashed = false;  // of a line
};

// A diagram: x against y with axes, ticks and a legend. Bars take x as bar number and their names from
// `bar_names`.
struct Plot {
  std::string name;  // file name without ending: "learning-curve"
  std::string title;
  std::string x_label;  // with unit: "iteration", "time (s)"
  std::string y_label;
  std::vector<Series> series = {};
  std::vector<std::string> bar_names = {};     // not empty: a bar chart of series[0]
  std::array<double, 2> y_range = {0.0, 0.0};  // equal: fitted to the data
  bool equal_scales = false;                   // one unit of x is as long as one of y
};

// The plot as an <svg> element, to stand in a page.
std::string plot_svg(const Plot& plot);
// The plot as a picture file. kFailed with the path.
Status plot_png(const Plot& plot, const std::string& path);

}  // namespace nido
