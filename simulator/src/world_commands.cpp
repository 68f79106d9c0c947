#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "ode_library.h"
#include "world_verbs.h"

namespace nido::sim {
namespace {

constexpr double kSmallest_m = 0.001;
constexpr double kLargest_m = 10;
constexpr double kFarthest_m = 100;
constexpr double kDensity_kg_m3 = 640;  // wood: a cube of 5 cm weighs 80 g
constexpr int kMostOfKind = 99;
constexpr double kDegree = std::numbers::pi / 180;

using Impl = Simulation::Impl;

// kinds that the old simulator knew; it compared four letters, so "smod" is "smodel"
constexpr std::array<const char*, 8> kMakeable = {"box", "sbox", "cyl",   "scyl",
                                                  "sph", "ssph", "model", "smodel"};
constexpr std::array<const char*, 11> kKinds = {"box",   "sbox",   "cyl",    "scyl", "sph",  "ssph",
                                                "model", "smodel", "basket", "bear", "table"};

bool same_word(const std::string& word, const std::string& kind) {
  return word == kind || (word.size() >= 4 && kind.size() > 4 && kind.starts_with(word));
}

template <std::size_t N>
std::string known_kind(const std::string& word, const std::array<const char*, N>& kinds) {
  for (const char* kind : kinds) {
    if (same_word(word, kind)) return kind;
  }
  return {};
}

std::vector<std::size_t> all_of_kind(const Impl& sim, const std::string& kind) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < sim.objects.size(); ++i) {
    if (sim.objects[i]->description().kind == kind) found.push_back(i);
  }
  return found;
}

}  // namespace

std::size_t read_object(const Impl& sim, Arguments& arguments) {
  if (!arguments.ok()) return 0;
  if (arguments.done()) {
    arguments.fail("too few words", "which object? give KIND N or a name");
    return 0;
  }
  // the longest run of words that is a name
  std::string name;
  std::size_t best = sim.objects.size();
  std::size_t best_words = 0;
  for (std::size_t w = 0; w < std::min<std::size_t>(arguments.left(), 8); ++w) {
    name += (w == 0 ? "" : " ") + arguments.peek(w);
    const int index = sim.find_object(name);
    if (index >= 0) {
      best = static_cast<std::size_t>(index);
      best_words = w + 1;
    }
  }
  const std::string kind = known_kind(arguments.peek(), kKinds);
  if (best_words > 0 &&
      (kind.empty() || best_words > 1 || arguments.left() == 1 || all_of_kind(sim, kind).empty())) {
    arguments.skip(best_words);
    return best;
  }
  if (kind.empty()) {
    arguments.fail("unrecognized object type",
                   "no object and no kind is called \"" + arguments.peek() + "\"");
    return 0;
  }
  arguments.skip();
  // a kind of which there is one needs no number
  const std::vector<std::size_t> found = all_of_kind(sim, kind);
  if (arguments.done()) {
    if (found.size() == 1) return found[0];
    arguments.fail("could not set index",
                   "there are " + std::to_string(found.size()) + " of kind " + kind + "; say which");
    return 0;
  }
  const int n = arguments.index("the index");
  if (!arguments.ok()) return 0;
  if (n > static_cast<int>(found.size())) {
    arguments.fail("out of range", "there are " + std::to_string(found.size()) + " of kind " + kind);
    return 0;
  }
  return found[static_cast<std::size_t>(n) - 1];
}

void objects_changed(Impl& sim) {
  ++sim.revision;
  sim.object_set = ++sim.last_object_set;
  sim.contacts->forget();
  sim.wake_all();
}

std::string pose_text(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  return vector_text(X.translation()) + " " + number_text(q.x()) + " " + number_text(q.y()) + " " +
         number_text(q.z()) + " " + number_text(q.w());
}

namespace {

Eigen::Isometry3d X_PortObject(const ObjectBody& object) {
  return X_WorldPort().inverse() * object.X_WorldObject();
}

std::string position_text(const ObjectBody& object) {
  return vector_text(X_PortObject(object).translation());
}

std::string make(Impl& sim, Arguments& arguments) {
  const std::string kind = known_kind(arguments.word("the kind"), kMakeable);
  if (arguments.ok() && kind.empty())
    arguments.fail("unrecognized object type", "box, cyl, sph, model, or with s in front");
  if (!arguments.ok()) return arguments.failure();
  const bool is_static = kind.starts_with('s') && kind != "sph";
  const std::string shape = is_static ? kind.substr(1) : kind;

  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  PlacedShape mesh;
  ShapeKind shape_kind = ShapeKind::kBox;
  double volume_m3 = 0;
  if (shape == "box") {
    size = arguments.vector("could not set size", "size", kSmallest_m, kLargest_m);
    volume_m3 = size.prod();
  } else if (shape == "sph") {
    shape_kind = ShapeKind::kSphere;
    size.x() = arguments.number("could not set radius", "the radius", kSmallest_m, kLargest_m);
    volume_m3 = 4.0 / 3.0 * std::numbers::pi * std::pow(size.x(), 3);
  } else if (shape == "cyl") {
    shape_kind = ShapeKind::kCylinder;
    size.x() = arguments.number("could not set radius", "the radius", kSmallest_m, kLargest_m);
    size.y() = arguments.number("could not set length", "the length", kSmallest_m, kLargest_m);
    volume_m3 = std::numbers::pi * size.x() * size.x() * size.y();
  } else {
    shape_kind = ShapeKind::kMesh;
    const std::string file = arguments.word("the model's file");
    mesh.shape.texture = arguments.word("the texture");
    if (arguments.ok()) {
      size = Eigen::Vector3d::Ones();
      mesh.shape.mesh_path = (std::filesystem::path(sim.model_folder) / file).string();
      auto loaded = load_mesh(mesh.shape.mesh_path, size);
      if (!loaded) {
        arguments.fail("Check spelling and location of model file", loaded.error().message);
      } else {
        mesh.mesh = *loaded;
        Eigen::AlignedBox3d box;
        for (const auto& v : mesh.mesh->vertices_m) box.extend(v);
        volume_m3 = 0.3 * box.volume();
        if (box.sizes().maxCoeff() > kLargest_m)
          arguments.fail("could not set size", "the model is larger than 10 m");
      }
      const std::string& t = mesh.shape.texture;
      if (t == "none") mesh.shape.texture.clear();
      if (t != "" && t != "checker" && t != "wood" && t != "fabric") {
        arguments.fail("could not set model texture", "textures are none, checker, wood, fabric");
      }
    }
  }
  const Eigen::Vector3d p_PortObject =
      arguments.vector("could not set location", "position", -kFarthest_m, kFarthest_m);
  std::array<float, 3> rgb = {0.7F, 0.7F, 0.7F};
  if (shape != "model") {
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
  const double mass = std::clamp(volume_m3 * kDensity_kg_m3, 0.002, 1000.0);
  std::string name;
  for (int n = count + 1; name.empty() || sim.find_object(name) >= 0; ++n)
    name = kind + " " + std::to_string(n);
  ObjectDescription object = make_simple(name, kind, shape_kind, size, mass, rgb);
  if (shape_kind == ShapeKind::kMesh) {
    object.shapes[0].mesh = mesh.mesh;
    object.shapes[0].shape.mesh_path = mesh.shape.mesh_path;
    object.shapes[0].shape.texture = mesh.shape.texture;
  }
  object.is_static = is_static;
  object.touches_robot = touches_robot;
  object.X_WorldObject = X_WorldPort() * Eigen::Translation3d(p_PortObject);
  sim.objects.push_back(std::make_unique<ObjectBody>(sim.world.id(), std::move(object)));
  objects_changed(sim);
  return "[ok]";
}

std::string get(Impl& sim, Arguments& arguments) {
  const std::string word = arguments.peek();
  if (word == "mdir") {
    arguments.skip();
    arguments.end();
    return arguments.ok() ? name_text(sim.model_folder) : arguments.failure();
  }
  for (const char* side : {"lhand", "rhand"}) {
    if (!same_word(word, side)) continue;
    arguments.skip();
    arguments.end();
    if (!arguments.ok()) return arguments.failure();
    const RobotBody::Frame frame = sim.robot->find_frame(sim.block.hands[*side == 'l' ? 0 : 1].frame);
    return vector_text((X_WorldPort().inverse() * sim.pose(frame)).translation());
  }
  if (word == "screen") return fail_reply("could not get screen", "this world has no screen");
  const std::size_t object = read_object(sim, arguments);
  arguments.end();
  return arguments.ok() ? position_text(*sim.objects[object]) : arguments.failure();
}

std::string set(Impl& sim, Arguments& arguments) {
  if (arguments.peek() == "mdir") {
    arguments.skip();
    const std::string folder = arguments.word("the folder");
    arguments.end();
    if (!arguments.ok()) return arguments.failure();
    if (!std::filesystem::is_directory(folder))
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

std::string count(Impl& sim, Arguments& arguments) {
  const std::string word = arguments.word("the kind");
  const std::string kind = known_kind(word, kKinds);
  if (arguments.ok() && kind.empty() && word != "all") {
    arguments.fail("unrecognized object type", "\"" + word + "\" is no kind of object");
  }
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  return std::to_string(word == "all" ? sim.objects.size() : all_of_kind(sim, kind).size());
}

std::string remove(Impl& sim, Arguments& arguments) {
  if (arguments.peek() == "all" && arguments.left() == 1) {
    // the table is furniture, not an object that somebody made
    std::erase_if(sim.objects, [](const auto& o) { return o->description().kind != "table"; });
    objects_changed(sim);
    return "[ok]";
  }
  const std::size_t index = read_object(sim, arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  sim.objects.erase(sim.objects.begin() + static_cast<std::ptrdiff_t>(index));
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
             kind + " " + std::to_string(n) + " " + position_text(*object) + ")";
  }
  return reply.empty() ? "[ok]" : reply;
}

// -- answers for the judge, in the root frame
// -----------------------------------------------------------------------

std::string where(Impl& sim, Arguments& arguments) {
  const std::size_t index = read_object(sim, arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const ObjectBody& object = *sim.objects[index];
  const Eigen::AlignedBox3d box = bounds(object.description());
  return pose_text(object.X_WorldObject() * Eigen::Translation3d(box.center())) + " " +
         vector_text(box.sizes());
}

std::string touching(Impl& sim, Arguments& arguments) {
  const std::size_t index = read_object(sim, arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const HoldQuery hold = sim.contacts->hold(index, sim.objects);
  const auto any = [](const auto& pads) {
    return std::any_of(pads.begin(), pads.end(), [](bool on) { return on; });
  };
  return std::string(any(hold.left) || any(hold.right) ? "1" : "0") + (hold.world ? " 1" : " 0");
}

std::string inside(Impl& sim, Arguments& arguments) {
  const std::size_t index = read_object(sim, arguments);
  const std::size_t basket = read_object(sim, arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  return sim.is_inside(index, basket) ? "1" : "0";
}

std::string palm(Impl& sim, Arguments& arguments) {
  const std::string side = arguments.word("left or right");
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  if (side != "left" && side != "right") return fail_reply("hand not recognized", "left or right");
  return pose_text(sim.pose(sim.robot->find_frame(sim.block.hands[side == "left" ? 0 : 1].frame)));
}

std::string contacts(Impl& sim, Arguments& arguments) {
  const std::size_t index = read_object(sim, arguments);
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  const std::string& name = sim.objects[index]->description().name;
  std::string reply;
  for (const ContactPair& pair : sim.contacts->pairs(sim.objects)) {
    const bool is_a = pair.a == name && !pair.a_is_robot;
    if (!is_a && pair.b != name) continue;
    reply += std::string(reply.empty() ? "" : " ") + "(" + name_text(is_a ? pair.b : pair.a) + " " +
             number_text(pair.force_N) + ")";
  }
  return reply.empty() ? "[ok]" : reply;
}

struct Verb {
  const char* name;
  std::string (*run)(Impl&, Arguments&);
  const char* usage;
  const char* example;
};

// docs/world.md lists the same verbs; a test compares
constexpr std::array<Verb, 26> kVerbs = {{
    {"mk", make,
     "mk [s]box SX SY SZ X Y Z R G B | [s]sph RADIUS X Y Z R G B | [s]cyl RADIUS LENGTH X Y Z R G B | "
     "[s]model FILE TEXTURE X Y Z, then [0|1]: touches the robot",
     "world mk box 0.05 0.05 0.05 0.1 0.6 0.3 1 0 0"},
    {"get", get, "get OBJECT | lhand | rhand | mdir: position", "world get box 1"},
    {"set", set, "set OBJECT X Y Z | mdir FOLDER", "world set box 1 0 0.6 0.35"},
    {"rot", rotate, "rot OBJECT [RX RY RZ]: degrees, R = Rx Ry Rz", "world rot box 1 0 45 0"},
    {"col", colour, "col OBJECT [R G B]", "world col box 1 0 0 1"},
    {"num", count, "num KIND | all", "world num box"},
    {"del", remove, "del OBJECT | all", "world del box 1"},
    {"grab", grab, "grab OBJECT left|right 1|0: refused, hands with fingers hold things themselves",
     "world grab box 1 right 1"},
    {"name", rename, "name OBJECT NEWNAME", "world name box 1 \"blue cube\""},
    {"mass", world_mass, "mass OBJECT [KG]", "world mass box 1 0.2"},
    {"density", world_density, "density OBJECT [KG/M3]: sets the mass by the volume",
     "world density box 1 640"},
    {"friction", world_friction, "friction OBJECT [MU]", "world friction box 1 0.5"},
    {"restitution", world_restitution, "restitution OBJECT [0..1]: a pair bounces with the lower of both",
     "world restitution sph 1 0.8"},
    {"speed", world_speed, "speed OBJECT [VX VY VZ [WX WY WZ]]: m/s and rad/s", "world speed sph 1 0 2 0"},
    {"force", world_force, "force OBJECT FX FY FZ [SECONDS]: N at the centre of mass, 0.01 s if not said",
     "world force box 1 0 0 2 0.5"},
    {"torque", world_torque, "torque OBJECT TX TY TZ [SECONDS]: N m; in place of the force before",
     "world torque box 1 0 0.01 0 0.1"},
    {"list", list, "list: (NAME KIND N X Y Z) of all objects", "world list"},
    {"snapshot", world_snapshot, "snapshot [NAME]: keeps the whole simulation to come back to",
     "world snapshot before"},
    {"restore", world_restore, "restore [NAME]: back to a snapshot; time goes on", "world restore before"},
    {"reset", world_reset, "reset: robot and objects as at the start; time goes on", "world reset"},
    {"where", where, "where OBJECT: x y z qx qy qz qw sx sy sz, centre and edges of its box, root frame",
     "world where box 1"},
    {"touching", touching,
     "touching OBJECT: 1 if a hand touches it, 1 if table, floor or another object does",
     "world touching box 1"},
    {"contacts", contacts, "contacts OBJECT: (NAME FORCE) of everything that touches it, N",
     "world contacts box 1"},
    {"inside", inside, "inside OBJECT BASKET: 1 or 0", "world inside box 1 basket"},
    {"palm", palm, "palm left|right: x y z qx qy qz qw of the palm frame, root frame", "world palm right"},
    {"link", world_link, "link [NAME]: x y z qx qy qz qw of a link, root frame; without a name, all names",
     "world link r_index_tip"},
}};

std::string help() {
  std::string text = "OBJECT is KIND N (box 1) or a name. x left, y up, z forward, m.";
  for (const Verb& verb : kVerbs) text += std::string("\nworld ") + verb.usage;
  return text + "\nworld help [VERB]: this, or one line with an example";
}

std::string unknown_verb() {
  std::string known;
  for (const Verb& verb : kVerbs) known += (known.empty() ? "" : ", ") + std::string(verb.name);
  return fail_reply("unrecognized command", "world knows " + known + ", help");
}

std::string help(Arguments& arguments) {
  arguments.skip();
  if (arguments.done()) return help();
  const std::string name = arguments.word("the verb");
  arguments.end();
  if (!arguments.ok()) return arguments.failure();
  for (const Verb& verb : kVerbs) {
    if (name == verb.name) return std::string("world ") + verb.usage + "\nexample: " + verb.example;
  }
  return unknown_verb();
}

}  // namespace

std::string run_world_command(Simulation::Impl& simulation, const std::string& line) {
  Words split = split_words(line);
  if (!split.trouble.empty()) return fail_reply("cannot read the line", split.trouble);
  if (split.words.empty()) return fail_reply("unrecognized command", "say world help");
  // the first word may be left out: `nido world list`
  Arguments arguments(std::move(split.words));
  if (arguments.peek() == "world") arguments.skip();
  const std::string verb = arguments.peek();
  if (verb == "help") return help(arguments);
  for (const Verb& known : kVerbs) {
    if (verb != known.name) continue;
    arguments.skip();
    try {
      return known.run(simulation, arguments);
    } catch (const OdeError& e) {
      return fail_reply("cannot create object of requested type", e.what());
    }
  }
  return unknown_verb();
}

}  // namespace nido::sim
