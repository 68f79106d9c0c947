#include "room.h"

#include <string>
#include <utility>

namespace nido::sim {
namespace {

// a hair below the floor of the physics, so that a floor that a world draws itself wins
constexpr double kFloor_m = -0.5976 - 0.0005;
constexpr double kHalfWidth_m = 2.6;
constexpr double kHeight_m = 2.7;
constexpr double kThickness_m = 0.1;

VisualInstance slab(std::string name, const Eigen::Vector3d& size_m, const Eigen::Vector3d& centre_World_m,
                    std::array<float, 4> rgba, std::string texture) {
  VisualInstance instance;
  instance.name = std::move(name);
  instance.shape.kind = ShapeKind::kBox;
  instance.shape.size = size_m;
  instance.shape.rgba = rgba;
  instance.shape.texture = std::move(texture);
  instance.shape.shininess = 0;
  instance.X_WorldShape.translation() = centre_World_m;
  return instance;
}

}  // namespace

std::vector<VisualInstance> makeRoom() {
  const std::array<float, 4> floor = {0.36F, 0.35F, 0.33F, 1};
  const std::array<float, 4> wall = {0.56F, 0.57F, 0.57F, 1};
  const std::array<float, 4> ceiling = {0.80F, 0.80F, 0.78F, 1};
  const std::array<float, 4> skirting = {0.68F, 0.68F, 0.66F, 1};
  const double w = 2 * kHalfWidth_m;
  const double t = kThickness_m;
  const double middle_m = kFloor_m + 0.5 * kHeight_m;
  std::vector<VisualInstance> room;
  room.push_back(slab("room floor", {w, w, t}, {0, 0, kFloor_m - 0.5 * t}, floor, "tiles"));
  room.push_back(slab("room ceiling", {w, w, t}, {0, 0, kFloor_m + kHeight_m + 0.5 * t}, ceiling, ""));
  for (const double side : {-1.0, 1.0}) {
    const double at_m = side * (kHalfWidth_m + 0.5 * t);
    const double board_m = side * (kHalfWidth_m - 0.01);
    const std::string name = side < 0 ? "1" : "2";
    room.push_back(slab("room wall x" + name, {t, w, kHeight_m}, {at_m, 0, middle_m}, wall, "plaster"));
    room.push_back(slab("room wall y" + name, {w, t, kHeight_m}, {0, at_m, middle_m}, wall, "plaster"));
    room.push_back(slab("room board x" + name, {0.02, w, 0.1}, {board_m, 0, kFloor_m + 0.05}, skirting, ""));
    room.push_back(slab("room board y" + name, {w, 0.02, 0.1}, {0, board_m, kFloor_m + 0.05}, skirting, ""));
  }
  return room;
}

}  // namespace nido::sim
