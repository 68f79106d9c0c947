#include "drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace nido::sim {
namespace {

constexpr Overlay::Colour kWhite = {240, 240, 240};
constexpr Overlay::Colour kContact = {255, 90, 60};
constexpr Overlay::Colour kTaxel = {255, 200, 40};
constexpr Overlay::Colour kPull = {60, 220, 120};

constexpr double kLine_px = 14;
constexpr double kLetter_px = 7.2;  // mean width of the small letters
constexpr double kMargin_px = 8;
constexpr double kColumn_px = 205;
constexpr double kWrittenFrom_N = 0.5;
constexpr double kArrow_m_N = 0.02;
constexpr double kLongestArrow_m = 0.3;

constexpr std::array<const char*, 9> kHelp = {"left button on a thing: pull it",
                                              "left button elsewhere: go round",
                                              "right button: shift     wheel: nearer, farther",
                                              "space: pause, go on     . (dot): one step of 10 ms",
                                              "c: what touches",
                                              "j: joints, degrees",
                                              "v: view of the start",
                                              "h: this help",
                                              "q: closes the window; the robot goes on"};

}  // namespace

std::optional<Drawing::Point> Drawing::seen(const Eigen::Vector3d& p_World_m) const {
  const Eigen::Vector3d p = camera_.X_WorldCamera.inverse() * p_World_m;
  if (p.z() < camera_.near_m) return std::nullopt;
  return Point{camera_.fx_px * p.x() / p.z() + camera_.cx_px, camera_.fy_px * p.y() / p.z() + camera_.cy_px};
}

void Drawing::words(double x_px, double y_px, const std::string& text) {
  overlay_.texts.push_back({x_px, y_px, text, kWhite});
}

void Drawing::contacts(const std::vector<ContactPair>& pairs) {
  for (const ContactPair& pair : pairs) {
    const std::optional<Point> at = seen(pair.p_World_m);
    if (!at) continue;
    overlay_.rings.push_back({at->x_px, at->y_px, 3 + 2 * std::sqrt(std::max(0.0, pair.force_N)), kContact});
    if (pair.force_N >= kWrittenFrom_N)
      overlay_.texts.push_back(
          {at->x_px + kMargin_px, at->y_px - 4, fmt::format("{:.1f} N", pair.force_N), kContact});
  }
}

void Drawing::taxel(const Eigen::Vector3d& p_World_m) {
  if (const std::optional<Point> at = seen(p_World_m))
    overlay_.rings.push_back({at->x_px, at->y_px, 2, kTaxel, true});
}

void Drawing::pull(const Eigen::Vector3d& p_World_m, const Eigen::Vector3d& p_WorldMouse_m,
                   const Eigen::Vector3d& force_World_N) {
  const std::optional<Point> body = seen(p_World_m);
  const std::optional<Point> mouse = seen(p_WorldMouse_m);
  const double force_N = force_World_N.norm();
  if (body && mouse) overlay_.lines.push_back({body->x_px, body->y_px, mouse->x_px, mouse->y_px, kWhite});
  if (!body || force_N <= 0) return;
  const double length_m = std::min(kLongestArrow_m, kArrow_m_N * force_N);
  if (const std::optional<Point> tip = seen(p_World_m + force_World_N * (length_m / force_N)))
    overlay_.lines.push_back({body->x_px, body->y_px, tip->x_px, tip->y_px, kPull, true});
  overlay_.texts.push_back(
      {body->x_px + kMargin_px, body->y_px + kLine_px, fmt::format("{:.1f} N", force_N), kPull});
}

void Drawing::joints(const std::vector<PartInfo>& parts, const std::vector<std::vector<double>>& angles_rad) {
  constexpr double kDegree = std::numbers::pi / 180;
  const auto rows = static_cast<std::size_t>(std::max(1.0, (camera_.height - 3 * kLine_px) / kLine_px));
  std::size_t row = 0;
  std::size_t column = 0;
  for (std::size_t part = 0; part < parts.size() && part < angles_rad.size(); ++part) {
    for (std::size_t j = 0; j < parts[part].joints.size() && j < angles_rad[part].size(); ++j) {
      if (row == rows) {
        row = 0;
        ++column;
      }
      words(kMargin_px + kColumn_px * static_cast<double>(column),
            kMargin_px + kLine_px * static_cast<double>(row + 1),
            fmt::format("{:7.1f}  {}", angles_rad[part][j] / kDegree, parts[part].joints[j].name));
      ++row;
    }
  }
  overlay_.panes.push_back({0, 0, kColumn_px * static_cast<double>(column + 1),
                            kMargin_px + kLine_px * (0.5 + static_cast<double>(column > 0 ? rows : row))});
}

void Drawing::help() {
  const double width_px = 370;
  const double x_px = camera_.width - width_px;
  overlay_.panes.push_back({x_px, 0, width_px, kMargin_px + kLine_px * (0.5 + kHelp.size())});
  for (std::size_t i = 0; i < kHelp.size(); ++i)
    words(x_px + kMargin_px, kMargin_px + kLine_px * static_cast<double>(i + 1), kHelp[i]);
}

void Drawing::status(const std::string& text) {
  const double y_px = camera_.height - kLine_px - 4;
  overlay_.panes.push_back({0, y_px, 2 * kMargin_px + kLetter_px * static_cast<double>(text.size()), 1e4});
  words(kMargin_px, y_px + kLine_px, text);
}

}  // namespace nido::sim
