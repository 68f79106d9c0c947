// The world port's verbs about where things are, and their colour.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "world_verbs.h"

namespace nido::sim {
namespace {

using Impl = Simulation::Impl;

constexpr double kFarthest_m = 100;
constexpr double kDegree = std::numbers::pi / 180;

std::string get(Impl& sim, Arguments& arguments) {
  const std::string word = arguments.peek();
  if (word == "mdir") {
    arguments.skip();
    arguments.end();
    return arguments.ok() ? name_text(sim.model_folder) : arguments.failure();
  }
  for (const char* side : {"lhand", "rhand"}) {
    if (word != side && word != std::string(side).substr(0, 4)) continue;
    arguments.skip();
    arguments.end();
    if (!arguments.ok()) return arguments.failure();
    const RobotBody::Frame frame = sim.robot->find_frame(sim.block.hands[*side == 'l' ? 0 : 1].frame);
    if (frame.link < 0) return fail_reply("hand not recognized", "this robot has no such hand");
    return vector_text((X_WorldPort().inverse() * sim.pose(frame)).translation());
  }
  if (word == "screen") return fail_reply("could not get screen", "this world has no screen");
  const std::size_t object = read_object(sim, arguments);
  arguments.end();
  return arguments.ok() ? vector_text(X_PortObject(*sim.objects[object]).translation()) : arguments.failure();
}

std::string set(Impl& sim, Arguments& arguments) {
  if (arguments.peek() == "mdir") {
    arguments.skip();
    const std::string folder = arguments.word("the folder");
    arguments.end();
    if (!arguments.ok()) return arguments.failure();
    std::error_code trouble;  // a name may be longer than any file system takes
    if (!std::filesystem::is_directory(folder, trouble))
      return fail_reply("could not set model directory", folder + " is no folder");
    sim.model_folder = folder;
    return "[ok]";
  }
  if (arguments.peek() == "screen") return fail_reply("could not set screen", "this world has no screen");
  const std::size_t index = read_object(sim, arguments);
  const Eigen::Vector3d p = arguments.vector("could not set location", "position", -kFarthest_m, kFarthest_m);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  ObjectBody& object = *sim.objects[index];
  Eigen::Isometry3d X = object.X_WorldObject();
  X.translation() = X_WorldPort() * p;
  object.place(X);
  sim.contacts->forget();
  sim.wake_all();
  return "[ok]";
}

// the setter's convention R = Rx * Ry * Rz; the getter is its inverse
std::string rotate(Impl& sim, Arguments& arguments) {
  const std::size_t index = read_object(sim, arguments);
  if (!arguments.ok()) return arguments.failure();
  ObjectBody& object = *sim.objects[index];
  const Eigen::Isometry3d X = X_PortObject(object);
  if (arguments.done()) {
    const Eigen::Matrix3d R = X.linear();
    const double ry = std::asin(std::clamp(R(0, 2), -1.0, 1.0));
    double rx = 0;
    double rz = 0;
    if (std::abs(R(0, 2)) < 1 - 1e-12) {
      rx = std::atan2(-R(1, 2), R(2, 2));
      rz = std::atan2(-R(0, 1), R(0, 0));
    } else {
      rx = std::atan2(R(2, 1), R(1, 1));
    }
    return vector_text(Eigen::Vector3d(rx, ry, rz) / kDegree);
  }
  const Eigen::Vector3d angle =
      kDegree * arguments.vector("could not set rotation", "rotation (degrees)", -36000, 36000);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  Eigen::Isometry3d turned = X;
  turned.linear() = (Eigen::AngleAxisd(angle.x(), Eigen::Vector3d::UnitX()) *
                     Eigen::AngleAxisd(angle.y(), Eigen::Vector3d::UnitY()) *
                     Eigen::AngleAxisd(angle.z(), Eigen::Vector3d::UnitZ()))
                        .toRotationMatrix();
  object.place(X_WorldPort() * turned);
  sim.contacts->forget();
  sim.wake_all();
  return "[ok]";
}

std::string colour(Impl& sim, Arguments& arguments) {
  const std::size_t index = read_object(sim, arguments);
  if (!arguments.ok()) return arguments.failure();
  ObjectBody& object = *sim.objects[index];
  if (arguments.done()) {
    const auto& rgba = object.description().shapes[0].shape.rgba;
    return vector_text(Eigen::Vector3d(rgba[0], rgba[1], rgba[2]));
  }
  const Eigen::Vector3d rgb = arguments.vector("could not set color", "colour", 0, 1);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  object.set_colour({static_cast<float>(rgb.x()), static_cast<float>(rgb.y()), static_cast<float>(rgb.z())});
  ++sim.revision;
  return "[ok]";
}

constexpr std::array<WorldVerb, 4> kVerbs = {{
    {"get", get, "OBJECT | lhand | rhand | mdir", "position of a thing or a palm, or the model folder",
     "world get box 1"},
    {"set", set, "OBJECT X Y Z | mdir FOLDER", "puts it there at rest; where models are looked for",
     "world set box 1 0 0.6 0.35"},
    {"rot", rotate, "OBJECT [RX RY RZ]",
     "degrees, R = Rx Ry Rz; the answer without numbers is in the same convention", "world rot box 1 0 45 0"},
    {"col", colour, "OBJECT [R G B]", "colour, 0 to 1", "world col box 1 0 0 1"},
}};

}  // namespace

WorldVerbs placing_verbs() { return {"Placing things", kVerbs}; }

}  // namespace nido::sim
