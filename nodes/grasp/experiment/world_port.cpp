#include "world_port.h"

#include <fmt/format.h>

#include <cmath>
#include <sstream>

namespace nido::grasp {

namespace {
constexpr double kCallTimeout_s = 5.0;
constexpr double kFloor_Root_m = -0.5976;
}  // namespace

Result<std::string> ask_world(Node& node, const std::string& line) {
  auto answer = node.call("/icubSim/world", line, kCallTimeout_s);
  if (answer && answer->rfind("[fail]", 0) == 0) {
    return Error{ErrorCode::kFailed, "the world answered " + *answer + " to: " + line};
  }
  return answer;
}

Eigen::Vector3d world_of_root(const Eigen::Vector3d& p_Root_m) {
  return {-p_Root_m.y(), p_Root_m.z() - kFloor_Root_m, -p_Root_m.x() - 0.026};
}

Result<Box> box_of(Node& node, const std::string& object) {
  auto where = ask_world(node, "world where \"" + object + "\"");
  if (!where) return where.error();
  Box box;
  std::istringstream in(*where);
  double q = 0;
  in >> box.p_Root_m.x() >> box.p_Root_m.y() >> box.p_Root_m.z() >> q >> q >> q >> q >> box.size_m.x() >>
      box.size_m.y() >> box.size_m.z();
  if (!in) return Error{ErrorCode::kFailed, "no box in the world's answer: " + *where};
  auto get = ask_world(node, "world get \"" + object + "\"");
  if (!get) return get.error();
  std::istringstream frame(*get);
  double x = 0;
  double y = 0;
  if (!(frame >> x >> y)) return Error{ErrorCode::kFailed, "no position in the world's answer: " + *get};
  box.frame_Root_m = y + kFloor_Root_m;
  return box;
}

Result<bool> touches_other(Node& node, const std::string& object) {
  auto answer = ask_world(node, "world touching \"" + object + "\"");
  if (!answer) return answer.error();
  std::istringstream in(*answer);
  int hand = 0;
  int other = 0;
  if (!(in >> hand >> other)) return Error{ErrorCode::kFailed, "no answer of two numbers: " + *answer};
  return other != 0;
}

Status place(Node& node, const std::string& object, const Eigen::Vector2d& p_Root_m, double frame_Root_m,
             double yaw_rad) {
  // upright: its frame points up, which is y of the world port
  auto turned = ask_world(node, fmt::format("world rot \"{}\" -90 0 {}", object, yaw_rad * 180.0 / M_PI));
  if (!turned) return turned.error();
  const Eigen::Vector3d p = world_of_root({p_Root_m.x(), p_Root_m.y(), frame_Root_m});
  auto there = ask_world(node, fmt::format("world set \"{}\" {} {} {}", object, p.x(), p.y(), p.z()));
  return there ? Status{} : Status{there.error()};
}

}  // namespace nido::grasp
