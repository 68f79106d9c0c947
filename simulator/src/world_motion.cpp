// The world port's verbs that change how things weigh, touch and move, and that go back in time.
#include <cmath>
#include <numbers>

#include "world_verbs.h"

namespace nido::sim {
namespace {

using Impl = Simulation::Impl;

constexpr std::size_t kMostSnapshots = 8;
constexpr double kLeastMass_kg = 0.001;
constexpr double kMostMass_kg = 1000;
constexpr double kMostSpeed_m_s = 50;
constexpr double kMostTurn_rad_s = 200;
constexpr double kMostForce_N = 1000;
constexpr double kMostTorque_Nm = 100;
constexpr double kLongestPush_s = 60;

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

// The verbs' frame is the port's: x left, y up, z forward.
Eigen::Vector3d to_world(const Eigen::Vector3d& v_Port) { return X_WorldPort().linear() * v_Port; }
Eigen::Vector3d to_port(const Eigen::Vector3d& v_World) {
  return X_WorldPort().linear().transpose() * v_World;
}

std::string push(Impl& sim, Arguments& arguments, const char* reason, const char* what, double most,
                 bool turns) {
  const std::size_t index = read_object(sim, arguments);
  const Eigen::Vector3d v = to_world(arguments.vector(reason, what, -most, most));
  const double duration_s =
      arguments.ok() && !arguments.done()
          ? arguments.number(reason, "the time (s)", Simulation::kControlPeriod_s, kLongestPush_s)
          : Simulation::kControlPeriod_s;
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  ObjectBody& object = *sim.objects[index];
  if (object.body() == nullptr) return no_motion(reason);
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  object.push(turns ? zero : v, turns ? v : zero, duration_s);
  return "[ok]";
}

std::string snapshot_name(Arguments& arguments) {
  std::string name = arguments.done() ? "default" : arguments.word("the name");
  arguments.end();
  if (arguments.ok() && (name.empty() || name.size() > 60))
    arguments.fail("could not set name", "a name has 1 to 60 characters");
  return name;
}

}  // namespace

std::string world_mass(Impl& sim, Arguments& arguments) {
  return property(
      sim, arguments, "mass", kLeastMass_kg, kMostMass_kg,
      [](const ObjectBody& o) { return o.body() == nullptr ? 0 : mass_kg(o.description()); },
      [](ObjectBody& o, double value) -> std::string {
        if (o.body() == nullptr) return "a static object has none";
        o.set_mass_kg(value);
        return {};
      });
}

std::string world_density(Impl& sim, Arguments& arguments) {
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

std::string world_friction(Impl& sim, Arguments& arguments) {
  return property(
      sim, arguments, "friction", 0, 10, [](const ObjectBody& o) { return o.description().surface.friction; },
      [](ObjectBody& o, double value) -> std::string {
        Surface surface = o.description().surface;
        surface.friction = value;
        o.set_surface(surface);
        return {};
      });
}

std::string world_restitution(Impl& sim, Arguments& arguments) {
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

std::string world_speed(Impl& sim, Arguments& arguments) {
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

std::string world_force(Impl& sim, Arguments& arguments) {
  return push(sim, arguments, "could not set force", "force (N)", kMostForce_N, false);
}

std::string world_torque(Impl& sim, Arguments& arguments) {
  return push(sim, arguments, "could not set torque", "torque (N m)", kMostTorque_Nm, true);
}

std::string world_link(Impl& sim, Arguments& arguments) {
  if (arguments.done()) {
    std::string names;
    for (const std::string& name : sim.link_names) names += (names.empty() ? "" : " ") + name_text(name);
    return names;
  }
  const std::string name = arguments.word("the link");
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const RobotBody::Frame frame = sim.robot->find_frame(name);
  if (frame.link < 0) {
    return fail_reply("link not recognized", "the robot has no link of that name; world link lists them");
  }
  return pose_text(sim.pose(frame));
}

std::string world_snapshot(Impl& sim, Arguments& arguments) {
  const std::string name = snapshot_name(arguments);
  if (!arguments.ok()) return arguments.failure();
  if (sim.snapshots.size() >= kMostSnapshots && sim.snapshots.count(name) == 0) {
    return fail_reply("too many snapshots",
                      "there are " + std::to_string(kMostSnapshots) + "; use a name again");
  }
  sim.snapshots[name] = sim.snapshot();
  return "[ok]";
}

std::string world_restore(Impl& sim, Arguments& arguments) {
  const std::string name = snapshot_name(arguments);
  if (!arguments.ok()) return arguments.failure();
  const auto found = sim.snapshots.find(name);
  if (found == sim.snapshots.end()) {
    std::string names;
    for (const auto& [known, snapshot] : sim.snapshots) names += (names.empty() ? "" : ", ") + known;
    return fail_reply("no such snapshot", names.empty() ? "there is none yet" : "there are: " + names);
  }
  // time goes on: whoever listens to the clock must not see it run backward
  const std::int64_t now = sim.period;
  if (Status done = sim.restore(found->second); !done)
    return fail_reply("could not restore", done.error().message);
  sim.drives->shift_time(static_cast<double>(now - sim.period) * Simulation::kControlPeriod_s);
  sim.period = now;
  return "[ok]";
}

std::string world_reset(Impl& sim, Arguments& arguments) {
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const std::int64_t now = sim.period;
  sim.reset();
  sim.drives->shift_time(static_cast<double>(now) * Simulation::kControlPeriod_s);
  sim.period = now;
  return "[ok]";
}

}  // namespace nido::sim
