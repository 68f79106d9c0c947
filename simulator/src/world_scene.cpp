// The world port's verbs about whole scenes: saving and loading, light, chance.
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "robot_base.h"
#include "world_verbs.h"

namespace nido::sim {
namespace {

using Impl = Simulation::Impl;

constexpr double kDegree = std::numbers::pi / 180;
constexpr const char* kEnding = ".yaml";

// -- a scene as a world file, docs/world.md

void put(YAML::Emitter& out, const char* key, std::initializer_list<double> values) {
  out << YAML::Key << key << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const double value : values) out << value;
  out << YAML::EndSeq;
}

void put(YAML::Emitter& out, const char* key, const Eigen::Vector3d& v) {
  put(out, key, {v.x(), v.y(), v.z()});
}

// R = Rz Ry Rx
void put_rpy(YAML::Emitter& out, const Eigen::Matrix3d& R) {
  const double pitch = std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
  const bool upright = std::abs(R(2, 0)) > 1 - 1e-12;
  const double roll = upright ? 0 : std::atan2(R(2, 1), R(2, 2));
  const double yaw = upright ? std::atan2(-R(0, 1), R(1, 1)) : std::atan2(R(1, 0), R(0, 0));
  put(out, "rpy_deg", {roll / kDegree, pitch / kDegree, yaw / kDegree});
}

void put_shape(YAML::Emitter& out, const PlacedShape& placed, double share) {
  const VisualShape& shape = placed.shape;
  constexpr std::array<const char*, 5> kNames = {"box", "sphere", "cylinder", "capsule", "mesh"};
  out << YAML::Flow << YAML::BeginMap;
  out << YAML::Key << "shape" << YAML::Value << kNames[static_cast<std::size_t>(shape.kind)];
  if (shape.kind == ShapeKind::kMesh) {
    out << YAML::Key << "file" << YAML::Value << std::filesystem::absolute(shape.mesh_path).string();
    put(out, "scale", shape.size);
  } else if (shape.kind == ShapeKind::kBox) {
    put(out, "size_m", shape.size);
  } else if (shape.kind == ShapeKind::kSphere) {
    put(out, "size_m", {shape.size.x()});
  } else {
    put(out, "size_m", {shape.size.x(), shape.size.y()});
  }
  put(out, "position_m", placed.X_OwnerShape.translation());
  put_rpy(out, placed.X_OwnerShape.linear());
  put(out, "colour", {shape.rgba[0], shape.rgba[1], shape.rgba[2]});
  if (!shape.texture.empty()) out << YAML::Key << "texture" << YAML::Value << shape.texture;
  out << YAML::Key << "mass_share" << YAML::Value << share;
  out << YAML::EndMap;
}

void put_object(YAML::Emitter& out, const ObjectBody& object) {
  const ObjectDescription& d = object.description();
  out << YAML::BeginMap;
  out << YAML::Key << "name" << YAML::Value << YAML::DoubleQuoted << d.name;
  out << YAML::Key << "kind" << YAML::Value << YAML::DoubleQuoted << d.kind;
  put(out, "position_m", object.X_WorldObject().translation());
  put_rpy(out, object.X_WorldObject().linear());
  out << YAML::Key << "static" << YAML::Value << d.is_static;
  out << YAML::Key << "touches_robot" << YAML::Value << d.touches_robot;
  out << YAML::Key << "friction" << YAML::Value << d.surface.friction;
  out << YAML::Key << "restitution" << YAML::Value << d.surface.restitution;
  out << YAML::Key << "rolling_m" << YAML::Value << d.surface.rolling_m;
  out << YAML::Key << "mass_kg" << YAML::Value << mass_kg(d);
  out << YAML::Key << "shapes" << YAML::Value << YAML::BeginSeq;
  for (const PlacedShape& shape : d.shapes) put_shape(out, shape, 1000 * shape.mass_kg / mass_kg(d));
  out << YAML::EndSeq << YAML::EndMap;
}

void put_joint(YAML::Emitter& out, const ObjectJointDescription& joint) {
  out << YAML::Flow << YAML::BeginMap;
  out << YAML::Key << "kind" << YAML::Value << to_string(joint.kind);
  out << YAML::Key << "between" << YAML::Value << YAML::Flow << YAML::BeginSeq << YAML::DoubleQuoted
      << joint.a << YAML::DoubleQuoted << joint.b << YAML::EndSeq;
  put(out, "at_m", joint.p_World_m);
  put(out, "axis", joint.axis_World);
  out << YAML::EndMap;
}

// where the robot's joints stand, within their limits, so that a run may begin there
void put_posture(YAML::Emitter& out, const Drives& drives) {
  out << YAML::Key << "posture_deg" << YAML::Value << YAML::BeginMap;
  for (std::size_t p = 0; p < drives.parts().size(); ++p) {
    const PartInfo& part = drives.parts()[p];
    const auto states = drives.joints(static_cast<int>(p));
    out << YAML::Key << part.name << YAML::Value << YAML::Flow << YAML::BeginSeq;
    for (std::size_t j = 0; j < part.joints.size(); ++j) {
      const JointInfo& joint = part.joints[j];
      out << std::clamp(states[j].position_rad, joint.min_rad, joint.max_rad) / kDegree;
    }
    out << YAML::EndSeq;
  }
  out << YAML::EndMap;
}

void put_light(YAML::Emitter& out, const Lighting& light) {
  out << YAML::Key << "light" << YAML::Value << YAML::BeginMap;
  out << YAML::Key << "brightness" << YAML::Value << light.brightness;
  out << YAML::Key << "key" << YAML::Value << light.key;
  out << YAML::Key << "fill" << YAML::Value << light.fill;
  out << YAML::Key << "ambient" << YAML::Value << light.ambient;
  out << YAML::Key << "shadows" << YAML::Value << light.shadows;
  put(out, "direction", light.key_direction_World);
  out << YAML::EndMap;
}

std::string scene_text(const Impl& sim) {
  YAML::Emitter out;
  out.SetDoublePrecision(17);
  out << YAML::Comment("a scene as it stood at " +
                       number_text(static_cast<double>(sim.period) * Simulation::kControlPeriod_s) + " s");
  out << YAML::BeginMap;
  put_posture(out, *sim.drives);
  put_light(out, sim.light);
  out << YAML::Key << "objects" << YAML::Value << YAML::BeginSeq;
  for (const auto& object : sim.objects) put_object(out, *object);
  out << YAML::EndSeq;
  if (!sim.joints.empty()) {
    out << YAML::Key << "joints" << YAML::Value << YAML::BeginSeq;
    for (const ObjectJoint& joint : sim.joints) put_joint(out, describe(joint, sim.objects));
    out << YAML::EndSeq;
  }
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

// -- the verbs

std::string save(Impl& sim, Arguments& arguments) {
  const std::string name = arguments.word("the name");
  arguments.end();
  const std::filesystem::path path = scene_file(sim, arguments, name, kEnding, true);
  if (!arguments.ok()) return arguments.failure();
  const std::string trouble = write_file(path, scene_text(sim));
  return trouble.empty() ? "[ok]" : fail_reply("could not save", trouble);
}

std::string load(Impl& sim, Arguments& arguments) {
  const std::string name = arguments.word("the name");
  arguments.end();
  SimulationOptions options = sim.options;
  options.target.clear();
  options.world_path = scene_file(sim, arguments, name, kEnding, false);
  if (!arguments.ok()) return arguments.failure();
  if (!std::filesystem::exists(options.world_path)) {
    const std::filesystem::path shipped = sim.options.urdf_path.parent_path().parent_path() / "worlds";
    if (std::filesystem::exists(shipped / (name + kEnding))) options.world_path = shipped / (name + kEnding);
  }
  auto read = read_world_with_base(options, sim.robot->description());
  if (!read) return fail_reply("could not load", read.error().message);
  if (Status done = sim.replace_objects(read->objects, read->joints); !done)
    return fail_reply("could not load", done.error().message);
  sim.start.objects = std::move(read->objects);
  sim.start.joints = std::move(read->joints);
  if (read->light) sim.light = sim.options.light = *read->light;
  objects_changed(sim);
  return "[ok]";
}

std::string light_text(const Lighting& light) {
  return "brightness " + number_text(light.brightness) + " key " + number_text(light.key) + " fill " +
         number_text(light.fill) + " ambient " + number_text(light.ambient) + " shadows " +
         (light.shadows ? "1" : "0") + " direction " + vector_text(to_port(light.key_direction_World));
}

std::string light(Impl& sim, Arguments& arguments) {
  constexpr const char* kReason = "could not set light";
  constexpr double kBrightest = 10;
  constexpr std::array<std::pair<const char*, double Lighting::*>, 4> kStrengths = {
      {{"brightness", &Lighting::brightness},
       {"key", &Lighting::key},
       {"fill", &Lighting::fill},
       {"ambient", &Lighting::ambient}}};
  if (arguments.done()) return light_text(sim.light);
  Lighting changed = sim.light;
  const std::string what = arguments.word("which light");
  const auto* strength = std::find_if(kStrengths.begin(), kStrengths.end(),
                                      [&](const auto& entry) { return what == entry.first; });
  if (strength != kStrengths.end()) {
    changed.*strength->second = arguments.number(kReason, "the light", 0, kBrightest);
  } else if (what == "shadows") {
    if (arguments.done()) arguments.fail("too few words", "shadows are 0 or 1");
    changed.shadows = arguments.flag("shadows", true);
  } else if (what == "direction") {
    const Eigen::Vector3d d = arguments.vector(kReason, "the direction towards the lamp", -1000, 1000);
    if (arguments.ok() && d.norm() < 1e-6) arguments.fail(kReason, "the direction to the lamp has no length");
    changed.key_direction_World = to_world(d);
  } else {
    arguments.fail("light not recognized", "brightness, key, fill, ambient, shadows, direction");
  }
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  sim.light = changed;
  return "[ok]";
}

std::string seed(Impl& sim, Arguments& arguments) {
  if (arguments.done()) return std::to_string(sim.options.seed);
  const double value = arguments.number("could not set seed", "the seed", 0, 9007199254740992.0);
  if (arguments.ok() && value != std::floor(value))
    arguments.fail("could not set seed", "a seed is a whole number");
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  SimulationOptions options = sim.options;
  options.seed = static_cast<std::uint64_t>(value);
  auto read = read_world_with_base(options, sim.robot->description());
  if (!read) return fail_reply("could not set seed", read.error().message);
  if (Status done = sim.replace_objects(read->objects, read->joints); !done)
    return fail_reply("could not set seed", done.error().message);
  sim.options.seed = options.seed;
  sim.start.objects = std::move(read->objects);
  sim.start.joints = std::move(read->joints);
  keep_time(sim, [&] { sim.reset(); });
  return "[ok]";
}

constexpr std::array<WorldVerb, 4> kVerbs = {{
    {"save", save, "NAME",
     "all objects, the light and the robot's posture as the world file NAME.yaml in the scene folder",
     "world save breakfast"},
    {"load", load, "NAME",
     "the objects and the light of NAME.yaml of the scene folder, or of the worlds that come with nido, in "
     "place of the present ones, also after a reset; the robot stays as it is",
     "world load breakfast"},
    {"light", light, "[brightness|key|fill|ambient VALUE | shadows 0|1 | direction X Y Z]",
     "the room's light that the cameras see, until a reset; 1 is normal; without words, how it is",
     "world light brightness 0.5"},
    {"seed", seed, "[N]", "draws a random world anew from this seed, and resets", "world seed 7"},
}};

}  // namespace

WorldVerbs scene_verbs() { return {"Scenes", kVerbs}; }

}  // namespace nido::sim
