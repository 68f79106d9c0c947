#include "paint.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace nido::sim {
namespace {

constexpr double kPaneShade = 0.45;
constexpr double kTextSize = 0.4;
constexpr double kFarthest_px = 30000;  // beyond it OpenCV's integers do not go

// pictures are red, green, blue, and so are their colours here
cv::Scalar colour_of(const Overlay::Colour& colour) {
  return {double(colour[0]), double(colour[1]), double(colour[2])};
}

cv::Point point_of(double x_px, double y_px) {
  const auto whole = [](double v) {
    return static_cast<int>(std::lround(std::clamp(v, -kFarthest_px, kFarthest_px)));
  };
  return {whole(x_px), whole(y_px)};
}

}  // namespace

void paint(const Overlay& overlay, Image& picture) {
  cv::Mat canvas(picture.height, picture.width, CV_8UC3, picture.rgb.data());
  for (const Overlay::Pane& pane : overlay.panes) {
    const cv::Rect all(0, 0, picture.width, picture.height);
    const cv::Rect part = cv::Rect(point_of(pane.x_px, pane.y_px),
                                   point_of(pane.x_px + pane.width_px, pane.y_px + pane.height_px)) &
                          all;
    if (part.area() > 0) canvas(part) *= kPaneShade;
  }
  for (const Overlay::Line& line : overlay.lines) {
    const cv::Point from = point_of(line.x0_px, line.y0_px);
    const cv::Point to = point_of(line.x1_px, line.y1_px);
    if (line.arrow) {
      cv::arrowedLine(canvas, from, to, colour_of(line.colour), 2, cv::LINE_AA, 0, 0.2);
    } else {
      cv::line(canvas, from, to, colour_of(line.colour), 1, cv::LINE_AA);
    }
  }
  for (const Overlay::Ring& ring : overlay.rings) {
    const int radius = static_cast<int>(std::lround(std::clamp(ring.radius_px, 1.0, 500.0)));
    cv::circle(canvas, point_of(ring.x_px, ring.y_px), radius, colour_of(ring.colour),
               ring.full ? cv::FILLED : 2, cv::LINE_AA);
  }
  for (const Overlay::Text& text : overlay.texts) {
    cv::putText(canvas, text.words, point_of(text.x_px, text.y_px), cv::FONT_HERSHEY_SIMPLEX, kTextSize,
                colour_of(text.colour), 1, cv::LINE_AA);
  }
}

}  // namespace nido::sim
