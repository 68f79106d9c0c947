#include "nido/report/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drawing.h"
#include "escape.h"

namespace nido {

namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 400;
constexpr double kLeft = 70;
constexpr double kRight = 20;
constexpr double kTop = 36;
constexpr double kBottom = 52;
constexpr std::array<int, 3> kInk = {60, 60, 60};
constexpr std::array<int, 3> kGrid = {225, 225, 225};
constexpr std::array<std::array<int, 3>, 8> kColours = {{{31, 119, 180},
                                                         {214, 84, 39},
                                                         {44, 140, 60},
                                                         {140, 86, 160},
                                                         {190, 150, 20},
                                                         {23, 160, 170},
                                                         {220, 100, 160},
                                                         {110, 110, 110}}};

bool finite(const std::array<double, 2>& point) { return std::isfinite(point[0]) && std::isfinite(point[1]); }

// ticks at round numbers: 1, 2 or 5 times a power of ten apart
std::vector<double> ticks(double low, double high) {
  const double rough = (high - low) / 6.0;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough) {
      step = factor * power;
      break;
    }
  }
  std::vector<double> result;
  for (double value = std::ceil(low / step - 1e-9) * step; value <= high + 1e-9 * step; value += step) {
    result.push_back(std::abs(value) < 1e-9 * step ? 0.0 : value);
  }
  return result;
}

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void include(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  void settle() {
    if (!(low <= high)) {
      low = 0.0;
      high = 1.0;
    }
    if (high - low < 1e-12) {
      low -= 0.5;
      high += 0.5;
    }
  }
};

void lay_out_bars(const Plot& plot, Drawing& drawing, const std::function<double(double)>& to_y,
                  double plot_width) {
  if (plot.series.empty()) return;
  const double slot = plot_width / static_cast<double>(plot.bar_names.size());
  for (const auto& point : plot.series[0].points) {
    if (!finite(point)) continue;
    const double x = kLeft + slot * (point[0] + 0.2);
    drawing.boxes.push_back({x, to_y(point[1]), slot * 0.6, to_y(0.0) - to_y(point[1]), kColours[0]});
    drawing.texts.push_back({x + slot * 0.3, to_y(point[1]) - 4, fmt::format("{:.3g}", point[1]), 11,
                             DrawnText::Anchor::kMiddle, false});
  }
  for (std::size_t i = 0; i < plot.bar_names.size(); ++i) {
    drawing.texts.push_back({kLeft + slot * (static_cast<double>(i) + 0.5), kHeight - kBottom + 16,
                             plot.bar_names[i], 11, DrawnText::Anchor::kMiddle, false});
  }
}

void lay_out_series(const Plot& plot, Drawing& drawing, const std::function<double(double)>& to_x,
                    const std::function<double(double)>& to_y) {
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const Series& series = plot.series[i];
    const auto rgb = kColours[i % kColours.size()];
    DrawnLine line{{}, rgb, 1.6, series.dashed};
    for (const auto& point : series.points) {
      if (!finite(point)) {
        if (line.points.size() > 1) drawing.lines.push_back(line);
        line.points.clear();
        continue;
      }
      const std::array<double, 2> place = {to_x(point[0]), to_y(point[1])};
      if (series.line) {
        line.points.push_back(place);
      } else {
        drawing.dots.push_back({place, rgb, 2.0});
      }
    }
    if (line.points.size() > 1) drawing.lines.push_back(line);
    if (!series.name.empty()) {
      const double y = kTop + 14 + 16 * static_cast<double>(i);
      drawing.boxes.push_back({kWidth - kRight - 150, y - 6, 14, 4, rgb});
      drawing.texts.push_back({kWidth - kRight - 130, y, series.name, 12, DrawnText::Anchor::kStart, false});
    }
  }
}

cv::Scalar bgr(const std::array<int, 3>& rgb) { return {double(rgb[2]), double(rgb[1]), double(rgb[0])}; }
cv::Point pixel(const std::array<double, 2>& point) {
  return {static_cast<int>(std::lround(point[0])), static_cast<int>(std::lround(point[1]))};
}

void paint_text(cv::Mat& image, const DrawnText& text) {
  const double scale = text.size_px / 30.0;
  int base = 0;
  const cv::Size size = cv::getTextSize(text.text, cv::FONT_HERSHEY_SIMPLEX, scale, 1, &base);
  const double shift = text.anchor == DrawnText::Anchor::kStart    ? 0.0
                       : text.anchor == DrawnText::Anchor::kMiddle ? size.width / 2.0
                                                                   : size.width;
  if (!text.upward) {
    cv::putText(image, text.text, pixel({text.x - shift, text.y}), cv::FONT_HERSHEY_SIMPLEX, scale, bgr(kInk),
                1, cv::LINE_AA);
    return;
  }
  // draw it lying, turn it, lay it over the white margin
  cv::Mat lying(size.height + base + 2, size.width + 2, CV_8UC3, cv::Scalar::all(255));
  cv::putText(lying, text.text, {0, size.height}, cv::FONT_HERSHEY_SIMPLEX, scale, bgr(kInk), 1, cv::LINE_AA);
  cv::Mat standing;
  cv::rotate(lying, standing, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Rect place(static_cast<int>(text.x) - size.height,
                       static_cast<int>(text.y - standing.rows + shift), standing.cols, standing.rows);
  const cv::Rect inside = place & cv::Rect(0, 0, image.cols, image.rows);
  if (inside.area() > 0) {
    standing(cv::Rect(inside.x - place.x, inside.y - place.y, inside.width, inside.height))
        .copyTo(image(inside));
  }
}

}  // namespace

Drawing lay_out(const Plot& plot) {
  const bool bars = !plot.bar_names.empty();
  Range x;
  Range y;
  for (const auto& series : plot.series) {
    for (const auto& point : series.points) {
      if (!finite(point)) continue;
      x.include(point[0]);
      y.include(point[1]);
    }
  }
  if (bars) y.include(0.0);
  x.settle();
  y.settle();
  const bool fixed = plot.y_range[0] < plot.y_range[1];
  if (fixed) {
    y.low = plot.y_range[0];
    y.high = plot.y_range[1];
  } else {
    const double margin = 0.06 * (y.high - y.low);
    y.high += margin;
    y.low -= bars && y.low >= 0.0 ? 0.0 : margin;
  }
  const double plot_width = kWidth - kLeft - kRight;
  const double plot_height = kHeight - kTop - kBottom;
  if (plot.equal_scales) {
    const double per_px = std::max((x.high - x.low) / plot_width, (y.high - y.low) / plot_height);
    const double x_middle = 0.5 * (x.low + x.high);
    const double y_middle = 0.5 * (y.low + y.high);
    x = {x_middle - 0.5 * per_px * plot_width, x_middle + 0.5 * per_px * plot_width};
    y = {y_middle - 0.5 * per_px * plot_height, y_middle + 0.5 * per_px * plot_height};
  }
  const std::function<double(double)> to_x = [=](double value) {
    return kLeft + (value - x.low) / (x.high - x.low) * plot_width;
  };
  const std::function<double(double)> to_y = [=](double value) {
    const double place = kTop + (y.high - value) / (y.high - y.low) * plot_height;
    return std::clamp(place, kTop, kTop + plot_height);
  };

  Drawing drawing;
  drawing.width = kWidth;
  drawing.height = kHeight;
  for (const double value : ticks(y.low, y.high)) {
    drawing.lines.push_back({{{kLeft, to_y(value)}, {kLeft + plot_width, to_y(value)}}, kGrid, 1.0, false});
    drawing.texts.push_back(
        {kLeft - 6, to_y(value) + 4, fmt::format("{:.4g}", value), 11, DrawnText::Anchor::kEnd, false});
  }
  if (bars) {
    lay_out_bars(plot, drawing, to_y, plot_width);
  } else {
    for (const double value : ticks(x.low, x.high)) {
      drawing.lines.push_back({{{to_x(value), kTop}, {to_x(value), kTop + plot_height}}, kGrid, 1.0, false});
      drawing.texts.push_back({to_x(value), kHeight - kBottom + 16, fmt::format("{:.6g}", value), 11,
                               DrawnText::Anchor::kMiddle, false});
    }
    lay_out_series(plot, drawing, to_x, to_y);
  }
  drawing.lines.push_back(
      {{{kLeft, kTop}, {kLeft, kTop + plot_height}, {kLeft + plot_width, kTop + plot_height}},
       kInk,
       1.0,
       false});
  drawing.texts.push_back({kWidth / 2.0, 20, plot.title, 14, DrawnText::Anchor::kMiddle, false});
  drawing.texts.push_back(
      {kLeft + plot_width / 2, kHeight - 12.0, plot.x_label, 12, DrawnText::Anchor::kMiddle, false});
  drawing.texts.push_back({16, kTop + plot_height / 2, plot.y_label, 12, DrawnText::Anchor::kMiddle, true});
  return drawing;
}

std::string plot_svg(const Plot& plot) {
  const Drawing drawing = lay_out(plot);
  const auto colour = [](const std::array<int, 3>& rgb) {
    return fmt::format("#{:02x}{:02x}{:02x}", rgb[0], rgb[1], rgb[2]);
  };
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\" "
      "font-family=\"sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
      drawing.width, drawing.height, escape_html(plot.title));
  for (const auto& box : drawing.boxes) {
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"/>\n",
                       box.x, box.y, box.width, box.height, colour(box.rgb));
  }
  for (const auto& line : drawing.lines) {
    std::string points;
    for (const auto& point : line.points) points += fmt::format("{:.1f},{:.1f} ", point[0], point[1]);
    svg += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{}/>\n",
                       points, colour(line.rgb), line.width, line.dashed ? " stroke-dasharray=\"6 4\"" : "");
  }
  for (const auto& dot : drawing.dots) {
    svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\"/>\n", dot.centre[0],
                       dot.centre[1], dot.radius, colour(dot.rgb));
  }
  for (const auto& text : drawing.texts) {
    const char* anchor = text.anchor == DrawnText::Anchor::kStart    ? "start"
                         : text.anchor == DrawnText::Anchor::kMiddle ? "middle"
                                                                     : "end";
    svg += fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{}\" text-anchor=\"{}\" fill=\"{}\"{}>{}</text>\n",
        text.x, text.y, text.size_px, anchor, colour(kInk),
        text.upward ? fmt::format(" transform=\"rotate(-90 {:.1f} {:.1f})\"", text.x, text.y) : "",
        escape_html(text.text));
  }
  return svg + "</svg>\n";
}

Status plot_png(const Plot& plot, const std::string& path) {
  const Drawing drawing = lay_out(plot);
  cv::Mat image(drawing.height, drawing.width, CV_8UC3, cv::Scalar::all(255));
  for (const auto& box : drawing.boxes) {
    cv::rectangle(image, pixel({box.x, box.y}), pixel({box.x + box.width, box.y + box.height}), bgr(box.rgb),
                  cv::FILLED);
  }
  for (const auto& line : drawing.lines) {
    for (std::size_t i = 1; i < line.points.size(); ++i) {
      if (line.dashed && i % 2 == 0) continue;
      cv::line(image, pixel(line.points[i - 1]), pixel(line.points[i]), bgr(line.rgb),
               static_cast<int>(std::ceil(line.width)), cv::LINE_AA);
    }
  }
  for (const auto& dot : drawing.dots) {
    cv::circle(image, pixel(dot.centre), static_cast<int>(dot.radius), bgr(dot.rgb), cv::FILLED, cv::LINE_AA);
  }
  for (const auto& text : drawing.texts) paint_text(image, text);
  bool written = false;
  try {
    written = cv::imwrite(path, image);
  } catch (const cv::Exception&) {
    written = false;
  }
  if (!written) return Error{ErrorCode::kFailed, fmt::format("cannot write the picture {}", path)};
  return {};
}

}  // namespace nido
