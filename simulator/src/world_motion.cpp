// The world port's verbs that change how things weigh, touch and move.
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "world_verbs.h"

namespace nido::sim {
namespace {

using Impl = Simulation::Impl;

constexpr double kLeastMass_kg = 0.001;
constexpr double kMostMass_kg = 1000;
constexpr double kMostSpeed_m_s = 50;
constexpr double kMostTurn_rad_s = 200;
constexpr double kMostForce_N = 1000;
constexpr double kMostTorque_Nm = 100;
constexpr double kLongestPush_s = 60;
constexpr double kFarthest_m = 100;

// What the shapes fill, counted one by one where they overlap.
double volume_m3(const ObjectDescription& description) {
  double sum = 0;
  for (const PlacedShape& placed : description.shapes) {
    const Eigen::Vector3d& s = placed.shape.size;
    const double round = std::numbers::pi * s.x() * s.x();
    switch (placed.shape.kind) {
      case ShapeKind::kBox:
        sum += s.prod();
        break;
      case ShapeKind::kSphere:
        sum += 4.0 / 3.0 * round * s.x();
        break;
      case ShapeKind::kCylinder:
        sum += round * s.y();
        break;
      case ShapeKind::kCapsule:
        sum += round * (s.y() + 4.0 / 3.0 * s.x());
        break;
      case ShapeKind::kMesh: {
        double mesh = 0;
        for (const auto& t : placed.mesh->triangles) {
          const auto& v = placed.mesh->vertices_m;
          mesh += v[t[0]].dot(v[t[1]].cross(v[t[2]])) / 6;
        }
        sum += std::abs(mesh);
        break;
      }
    }
  }
  return sum;
}

std::string no_motion(const char* reason) { return fail_reply(reason, "a static object does not move"); }

// One number of an object: without words its value, with one it is set. `set` answers why not, or nothing.
template <class Get, class Set>
std::string property(Impl& sim, Arguments& arguments, const char* what, double lowest, double highest,
                     Get get, Set set) {
  const std::size_t index = read_object(sim, arguments);
  if (!arguments.ok()) return arguments.failure();
  ObjectBody& object = *sim.objects[index];
  const std::string reason = std::string("could not set ") + what;
  if (arguments.done()) return number_text(get(object));
  const double value = arguments.number(reason.c_str(), what, lowest, highest);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const std::string trouble = set(object, value);
  if (!trouble.empty()) return fail_reply(reason, trouble);
  sim.wake_all();
  return "[ok]";
}

std::string push(Impl& sim, Arguments& arguments, const char* reason, const char* what, double most,
                 bool turns) {
  const std::size_t index = read_object(sim, arguments);
  const Eigen::Vector3d v = to_world(arguments.vector(reason, what, -most, most));
  const double duration_s =
      arguments.ok() && !arguments.done()
          ? arguments.number(reason, "the time (s)", Simulation::kControlPeriod_s, kLongestPush_s)
          : Simulation::kControlPeriod_s;
  std::optional<Eigen::Vector3d> p_World_m;
  if (arguments.ok() && !turns && !arguments.done())
    p_World_m = X_WorldPort() * arguments.vector(reason, "the point (m)", -kFarthest_m, kFarthest_m);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  ObjectBody& object = *sim.objects[index];
  if (object.body() == nullptr) return no_motion(reason);
  ObjectBody::Push push;
  (turns ? push.torque_World_Nm : push.force_World_N) = v;
  push.left_s = duration_s;
  if (p_World_m) push.p_ComPoint_Body_m = object.point_of_body(*p_World_m);
  object.push(push);
  return "[ok]";
}

std::string set_mass(Impl& sim, Arguments& arguments) {
  return property(
      sim, arguments, "mass", kLeastMass_kg, kMostMass_kg,
      [](const ObjectBody& o) { return o.body() == nullptr ? 0 : mass_kg(o.description()); },
      [](ObjectBody& o, double value) -> std::string {
        if (o.body() == nullptr) return "a static object has none";
        o.set_mass_kg(value);
        return {};
      });
}

std::string set_density(Impl& sim, Arguments& arguments) {
  return property(
      sim, arguments, "density", 0.1, 30000,
      [](const ObjectBody& o) {
        const double volume = volume_m3(o.description());
        return o.body() == nullptr || volume <= 0 ? 0 : mass_kg(o.description()) / volume;
      },
      [](ObjectBody& o, double value) -> std::string {
        if (o.body() == nullptr) return "a static object has none";
        const double mass = value * volume_m3(o.description());
        if (mass < kLeastMass_kg || mass > kMostMass_kg) {
          return "it would weigh " + number_text(mass) + " kg; allowed are " + number_text(kLeastMass_kg) +
                 " to " + number_text(kMostMass_kg);
        }
        o.set_mass_kg(mass);
        return {};
      });
}

std::string set_friction(Impl& sim, Arguments& arguments) {
  return property(
      sim, arguments, "friction", 0, 10, [](const ObjectBody& o) { return o.description().surface.friction; },
      [](ObjectBody& o, double value) -> std::string {
        Surface surface = o.description().surface;
        surface.friction = value;
        o.set_surface(surface);
        return {};
      });
}

std::string set_restitution(Impl& sim, Arguments& arguments) {
  return property(
      sim, arguments, "restitution", 0, 1,
      [](const ObjectBody& o) { return o.description().surface.restitution; },
      [](ObjectBody& o, double value) -> std::string {
        Surface surface = o.description().surface;
        surface.restitution = value;
        o.set_surface(surface);
        return {};
      });
}

std::string set_speed(Impl& sim, Arguments& arguments) {
  constexpr const char* kReason = "could not set speed";
  const std::size_t index = read_object(sim, arguments);
  if (!arguments.ok()) return arguments.failure();
  ObjectBody& object = *sim.objects[index];
  if (arguments.done()) {
    const ObjectState state = object.state();
    return vector_text(to_port(state.v_World_m_s)) + " " + vector_text(to_port(state.w_World_rad_s));
  }
  const Eigen::Vector3d v = arguments.vector(kReason, "speed (m/s)", -kMostSpeed_m_s, kMostSpeed_m_s);
  Eigen::Vector3d w = Eigen::Vector3d::Zero();
  if (arguments.ok() && !arguments.done())
    w = arguments.vector(kReason, "turn rate (rad/s)", -kMostTurn_rad_s, kMostTurn_rad_s);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  if (object.body() == nullptr) return no_motion(kReason);
  object.set_velocity(to_world(v), to_world(w));
  sim.wake_all();
  return "[ok]";
}

std::string set_force(Impl& sim, Arguments& arguments) {
  return push(sim, arguments, "could not set force", "force (N)", kMostForce_N, false);
}

std::string set_torque(Impl& sim, Arguments& arguments) {
  return push(sim, arguments, "could not set torque", "torque (N m)", kMostTorque_Nm, true);
}

constexpr std::array<WorldVerb, 7> kVerbs = {{
    {"mass", set_mass, "OBJECT [KG]", "its mass", "world mass box 1 0.2"},
    {"density", set_density, "OBJECT [KG/M3]", "sets the mass by the volume", "world density box 1 640"},
    {"friction", set_friction, "OBJECT [MU]", "a pair slides at the geometric mean of both",
     "world friction box 1 0.5"},
    {"restitution", set_restitution, "OBJECT [0..1]", "a pair bounces with the lower of both",
     "world restitution sph 1 0.8"},
    {"speed", set_speed, "OBJECT [VX VY VZ [WX WY WZ]]", "m/s and rad/s", "world speed sph 1 0 2 0"},
    {"force", set_force, "OBJECT FX FY FZ [SECONDS [X Y Z]]",
     "N, for 0.01 s if not said, at the centre of mass or at a point, which then moves with the thing; in "
     "place of the push before",
     "world force box 1 0 0 2 0.5 0.12 0.6 0.3"},
    {"torque", set_torque, "OBJECT TX TY TZ [SECONDS]", "N m; in place of the push before",
     "world torque box 1 0 0.01 0 0.1"},
}};

}  // namespace

WorldVerbs motion_verbs() { return {"How things weigh, touch and move", kVerbs}; }

}  // namespace nido::sim
