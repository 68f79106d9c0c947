#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nido/simulator/render/camera.h"
#include "nido/simulator/simulation.h"
#include "nido/simulator/window/screen.h"

namespace nido::sim {

// What is drawn over a picture; points of the world are seen through its camera, those behind it left out.
class Drawing {
 public:
  Drawing(const Camera& camera, Overlay& overlay) : camera_(camera), overlay_(overlay) {}

  // Rings where things touch, the wider the stronger, with newtons beside the strong ones.
  void contacts(const std::vector<ContactPair>& pairs);
  // A dot on each taxel that feels something.
  void taxel(const Eigen::Vector3d& p_World_m);
  // The spring from a point of a body to the mouse, and its force as an arrow.
  void pull(const Eigen::Vector3d& p_World_m, const Eigen::Vector3d& p_WorldMouse_m,
            const Eigen::Vector3d& force_World_N);
  // Names and angles of all joints, degrees, in columns.
  void joints(const std::vector<PartInfo>& parts, const std::vector<std::vector<double>>& angles_rad);
  void help();
  // A line at the bottom.
  void status(const std::string& words);

 private:
  struct Point {
    double x_px, y_px;
  };
  [[nodiscard]] std::optional<Point> seen(const Eigen::Vector3d& p_World_m) const;
  void words(double x_px, double y_px, const std::string& text);

  const Camera& camera_;
  Overlay& overlay_;
};

}  // namespace nido::sim
