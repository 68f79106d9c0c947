// The world port's verbs that make and delete things, count them and name them.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "world_verbs.h"

namespace nido::sim {
namespace {

using Impl = Simulation::Impl;

constexpr double kSmallest_m = 0.001;
constexpr double kLargest_m = 10;
constexpr double kFarthest_m = 100;
constexpr double kDensity_kg_m3 = 640;  // wood: a cube of 5 cm weighs 80 g
constexpr int kMostOfKind = 99;

// What a line asks for: its shape, and how much of it there is.
struct Shape {
  ShapeKind kind = ShapeKind::kBox;
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  double volume_m3 = 0;
  // meshes only
  std::string path{};
  std::string texture{};
  std::shared_ptr<const TriangleMesh> mesh{};
};

Shape read_box(const Impl& /*sim*/, Arguments& arguments) {
  Shape shape;
  shape.size = arguments.vector("could not set size", "size", kSmallest_m, kLargest_m);
  shape.volume_m3 = shape.size.prod();
  return shape;
}

Shape read_sphere(const Impl& /*sim*/, Arguments& arguments) {
  Shape shape;
  shape.kind = ShapeKind::kSphere;
  shape.size.x() = arguments.number("could not set radius", "the radius", kSmallest_m, kLargest_m);
  shape.volume_m3 = 4.0 / 3.0 * std::numbers::pi * std::pow(shape.size.x(), 3);
  return shape;
}

Shape read_cylinder(const Impl& /*sim*/, Arguments& arguments) {
  Shape shape;
  shape.kind = ShapeKind::kCylinder;
  shape.size.x() = arguments.number("could not set radius", "the radius", kSmallest_m, kLargest_m);
  shape.size.y() = arguments.number("could not set length", "the length", kSmallest_m, kLargest_m);
  shape.volume_m3 = std::numbers::pi * shape.size.x() * shape.size.x() * shape.size.y();
  return shape;
}

Shape read_model(const Impl& sim, Arguments& arguments) {
  Shape shape;
  shape.kind = ShapeKind::kMesh;
  shape.size.setOnes();
  const std::string file = arguments.word("the model's file");
  shape.texture = arguments.word("the texture");
  if (!arguments.ok()) return shape;
  shape.path = (std::filesystem::path(sim.model_folder) / file).string();
  auto loaded = load_mesh(shape.path, shape.size);
  if (!loaded) {
    arguments.fail("Check spelling and location of model file", loaded.error().message);
    return shape;
  }
  shape.mesh = *loaded;
  Eigen::AlignedBox3d box;
  for (const auto& v : shape.mesh->vertices_m) box.extend(v);
  shape.volume_m3 = 0.3 * box.volume();
  if (box.sizes().maxCoeff() > kLargest_m)
    arguments.fail("could not set size", "the model is larger than 10 m");
  if (shape.texture == "none") shape.texture.clear();
  if (shape.texture != "" && shape.texture != "checker" && shape.texture != "wood" &&
      shape.texture != "fabric")
    arguments.fail("could not set model texture", "textures are none, checker, wood, fabric");
  return shape;
}

Shape read_shape(const Impl& sim, Arguments& arguments, const std::string& word) {
  constexpr std::array<std::pair<const char*, Shape (*)(const Impl&, Arguments&)>, 4> kShapes = {
      {{"box", read_box}, {"sph", read_sphere}, {"cyl", read_cylinder}, {"model", read_model}}};
  for (const auto& [name, read] : kShapes) {
    if (word == name) return read(sim, arguments);
  }
  return {};
}

std::string make(Impl& sim, Arguments& arguments) {
  const std::string kind = makeable_kind(arguments.word("the kind"));
  if (arguments.ok() && kind.empty())
    arguments.fail("unrecognized object type", "box, cyl, sph, model, or with s in front");
  if (!arguments.ok()) return arguments.failure();
  const bool is_static = kind.starts_with('s') && kind != "sph";
  const Shape shape = read_shape(sim, arguments, is_static ? kind.substr(1) : kind);
  const Eigen::Vector3d p_PortObject =
      arguments.vector("could not set location", "position", -kFarthest_m, kFarthest_m);
  std::array<float, 3> rgb = {0.7F, 0.7F, 0.7F};
  if (shape.kind != ShapeKind::kMesh) {
    const Eigen::Vector3d colour = arguments.vector("could not set color", "colour", 0, 1);
    for (int i = 0; i < 3; ++i) rgb[i] = static_cast<float>(colour[i]);
  }
  const bool touches_robot = arguments.flag("the collide flag", true);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();

  const int count = static_cast<int>(all_of_kind(sim, kind).size());
  if (count >= kMostOfKind) {
    return fail_reply("too many objects",
                      "there are " + std::to_string(count) + " of kind " + kind + "; delete some");
  }
  std::string name;
  for (int n = count + 1; name.empty() || sim.find_object(name) >= 0; ++n)
    name = kind + " " + std::to_string(n);
  const double mass_kg = std::clamp(shape.volume_m3 * kDensity_kg_m3, 0.002, 1000.0);
  ObjectDescription object = make_simple(name, kind, shape.kind, shape.size, mass_kg, rgb);
  object.shapes[0].mesh = shape.mesh;
  object.shapes[0].shape.mesh_path = shape.path;
  object.shapes[0].shape.texture = shape.texture;
  object.is_static = is_static;
  object.touches_robot = touches_robot;
  object.X_WorldObject = X_WorldPort() * Eigen::Translation3d(p_PortObject);
  sim.objects.push_back(std::make_unique<ObjectBody>(sim.world.id(), std::move(object)));
  objects_changed(sim);
  return "[ok]";
}

std::string count(Impl& sim, Arguments& arguments) {
  const std::string word = arguments.word("the kind");
  const std::string kind = object_kind(word);
  if (arguments.ok() && kind.empty() && word != "all") {
    arguments.fail("unrecognized object type", "\"" + word + "\" is no kind of object");
  }
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  return std::to_string(word == "all" ? sim.objects.size() : all_of_kind(sim, kind).size());
}

std::string remove(Impl& sim, Arguments& arguments) {
  if (arguments.peek() == "all" && arguments.left() == 1) {
    // table and stand are furniture, not objects that somebody made
    for (std::size_t i = sim.objects.size(); i-- > 0;) {
      const std::string& kind = sim.objects[i]->description().kind;
      if (kind != "table" && kind != "stand") sim.erase_object(i);
    }
    objects_changed(sim);
    return "[ok]";
  }
  const std::size_t index = read_object(sim, arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  sim.erase_object(index);
  objects_changed(sim);
  return "[ok]";
}

std::string grab(Impl& sim, Arguments& arguments) {
  const std::size_t index = read_object(sim, arguments);
  const std::string hand = arguments.word("left or right");
  arguments.flag("1 or 0", true);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  if (hand != "left" && hand != "right") return fail_reply("hand not recognized", "left or right");
  if (sim.objects[index]->body() == nullptr) return fail_reply("grab requires a dynamic object", "");
  return fail_reply(hand + " hand must be disabled, cannot use grab with fingers",
                    "things are held by the fingers here: drive the arm");
}

std::string rename(Impl& sim, Arguments& arguments) {
  const std::size_t index = read_object(sim, arguments);
  const std::string name = arguments.word("the new name");
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  if (name.empty() || name.size() > 60)
    return fail_reply("could not set name", "a name has 1 to 60 characters");
  const int owner = sim.find_object(name);
  if (owner >= 0 && owner != static_cast<int>(index))
    return fail_reply("could not set name", name + " is taken");
  sim.objects[index]->set_name(name);
  ++sim.revision;
  return "[ok]";
}

std::string list(Impl& sim, Arguments& arguments) {
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  std::string reply;
  for (const auto& object : sim.objects) {
    const std::string& kind = object->description().kind;
    int n = 0;
    for (const std::size_t i : all_of_kind(sim, kind)) {
      ++n;
      if (sim.objects[i] == object) break;
    }
    reply += std::string(reply.empty() ? "" : " ") + "(" + name_text(object->description().name) + " " +
             kind + " " + std::to_string(n) + " " + vector_text(X_PortObject(*object).translation()) + ")";
  }
  return reply.empty() ? "[ok]" : reply;
}

constexpr std::array<WorldVerb, 6> kVerbs = {{
    {"mk", make,
     "[s]box SX SY SZ X Y Z R G B [0|1] | [s]sph RADIUS X Y Z R G B [0|1] | "
     "[s]cyl RADIUS LENGTH X Y Z R G B [0|1] | [s]model FILE TEXTURE X Y Z [0|1]",
     "makes a box, a ball, a cylinder along its z, or a mesh from the model folder (OBJ, STL, DAE; textures: "
     "none, checker, wood, fabric); s: nothing moves it; the last word: does it touch the robot",
     "world mk box 0.05 0.05 0.05 0.1 0.6 0.3 1 0 0"},
    {"del", remove, "OBJECT | all", "deletes; all leaves table and stand", "world del box 1"},
    {"num", count, "KIND | all", "how many there are", "world num box"},
    {"list", list, "", "(NAME KIND N X Y Z) of everything", "world list"},
    {"name", rename, "OBJECT NEWNAME", "another name", "world name box 1 \"blue cube\""},
    {"grab", grab, "OBJECT left|right 1|0", "refused: hands with fingers hold things themselves",
     "world grab box 1 right 1"},
}};

}  // namespace

WorldVerbs making_verbs() { return {"Making things", kVerbs}; }

}  // namespace nido::sim
