#include "world_file.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

#include "random_world.h"
#include "yaml_reader.h"

namespace nido::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kFarthest_m = 20;
constexpr double kLargest_m = 10;
constexpr double kSmallest_m = 0.001;
constexpr std::size_t kMostShapes = 64;
constexpr double kBrightest = 10;

using Rgb = std::array<float, 3>;

const std::map<std::string, Rgb>& colours() {
  static const std::map<std::string, Rgb> kColours = {
      {"blue", {0.05F, 0.12F, 0.85F}},   {"red", {0.85F, 0.05F, 0.05F}},   {"green", {0.05F, 0.65F, 0.10F}},
      {"yellow", {0.90F, 0.85F, 0.05F}}, {"brown", {0.36F, 0.20F, 0.09F}}, {"tan", {0.62F, 0.45F, 0.28F}},
      {"orange", {0.95F, 0.64F, 0.08F}}, {"white", {0.9F, 0.9F, 0.9F}},    {"grey", {0.5F, 0.5F, 0.5F}},
      {"black", {0.08F, 0.08F, 0.08F}},  {"wood", {0.78F, 0.70F, 0.60F}}};
  return kColours;
}

// a name or three numbers 0..1
Rgb read_colour(YamlReader& map, const Rgb& fallback) {
  if (!map.has("colour")) return fallback;
  if (map.node("colour").IsScalar()) {
    const std::string name = map.text("colour", "");
    const auto found = colours().find(name);
    if (found != colours().end()) return found->second;
    std::string list;
    for (const auto& [known, rgb] : colours()) list += (list.empty() ? "" : ", ") + known;
    map.complain("colour", "is \"" + name + "\"; allowed are " + list + " or three numbers 0..1");
    return fallback;
  }
  const std::vector<double> v = map.numbers("colour", {1, 1, 1}, 3, 3, 0, 1);
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

Eigen::Matrix3d from_rpy_deg(const Eigen::Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z() * kDegree, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy.y() * kDegree, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x() * kDegree, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

PlacedShape read_shape(YamlReader map, const Rgb& colour, const std::filesystem::path& folder,
                       YamlReader& parent, double& share) {
  map.allow({"shape", "size_m", "position_m", "rpy_deg", "colour", "texture", "file", "scale", "mass_share"});
  PlacedShape placed;
  const std::string kind = map.choice("shape", "box", {"box", "sphere", "cylinder", "capsule", "mesh"});
  const auto size = [&](std::size_t n) {
    if (!map.has("size_m")) map.complain(nullptr, "needs size_m");
    const std::vector<double> v =
        map.numbers("size_m", std::vector<double>(n, 0.05), n, n, kSmallest_m, kLargest_m);
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < n; ++i) out[static_cast<Eigen::Index>(i)] = v[i];
    return out;
  };
  if (kind == "box") {
    placed.shape.kind = ShapeKind::kBox;
    placed.shape.size = size(3);
  } else if (kind == "sphere") {
    placed.shape.kind = ShapeKind::kSphere;
    placed.shape.size = size(1);
  } else if (kind == "mesh") {
    placed.shape.kind = ShapeKind::kMesh;
    placed.shape.size = map.vector("scale", Eigen::Vector3d::Ones(), 1e-6, 1e3);
    placed.shape.mesh_path = (folder / map.text("file", "")).string();
    auto mesh = load_mesh(placed.shape.mesh_path, placed.shape.size);
    if (mesh) {
      placed.mesh = *mesh;
    } else {
      map.complain("file", mesh.error().message);
    }
  } else {
    placed.shape.kind = kind == "cylinder" ? ShapeKind::kCylinder : ShapeKind::kCapsule;
    placed.shape.size = size(2);
  }
  placed.X_OwnerShape.translation() =
      map.vector("position_m", Eigen::Vector3d::Zero(), -kLargest_m, kLargest_m);
  placed.X_OwnerShape.linear() = from_rpy_deg(map.vector("rpy_deg", Eigen::Vector3d::Zero(), -360, 360));
  const Rgb rgb = read_colour(map, colour);
  placed.shape.rgba = {rgb[0], rgb[1], rgb[2], 1};
  placed.shape.texture = map.text("texture", "");
  share = map.number("mass_share", 1, 0.001, 1e6);
  parent.adopt(map);
  return placed;
}

// keys that an object's file and an entry of a world share
void read_common(YamlReader& map, ObjectDescription& object) {
  object.is_static = map.flag("static", object.is_static);
  object.touches_robot = map.flag("touches_robot", object.touches_robot);
  object.surface.friction = map.number("friction", object.surface.friction, 0, 10);
  object.surface.restitution = map.number("restitution", object.surface.restitution, 0, 1);
  object.surface.rolling_m = map.number("rolling_m", object.surface.rolling_m, 0, 0.1);
  if (map.has("mass_kg")) set_mass(object, map.number("mass_kg", 0.1, 0.001, 1000));
}

struct WorldReader {
  const SimulationOptions& options;
  std::filesystem::path objects_folder;
  std::filesystem::path folder;  // of the world file: meshes are seen from there
  WorldDescription world;
  double table_height_m = Simulation::kFloorHeight_m;

  Result<ObjectDescription> read_object_file(const std::string& type) {
    const std::filesystem::path path = objects_folder / (type + ".yaml");
    std::error_code trouble;  // a name may be longer than any file system takes
    if (type.find('/') != std::string::npos || !std::filesystem::exists(path, trouble)) {
      return Error{ErrorCode::kNotFound, "there is no object file " + path.string()};
    }
    YAML::Node node;
    try {
      node = YAML::LoadFile(path.string());
    } catch (const YAML::Exception& e) {
      return Error{ErrorCode::kInvalidArgument, path.string() + ": " + e.what()};
    }
    YamlReader map(node, path.string(), "");
    map.allow({"kind", "mass_kg", "friction", "restitution", "rolling_m", "colour", "shapes", "static",
               "touches_robot"});
    ObjectDescription object = read_shapes(map, type, path.parent_path());
    read_common(map, object);
    if (!map.ok()) return Error{ErrorCode::kInvalidArgument, map.trouble()};
    return object;
  }

  // What a thing is: of an object file, or of an entry of a world that names none.
  static ObjectDescription read_shapes(YamlReader& map, const std::string& name,
                                       const std::filesystem::path& folder) {
    ObjectDescription object;
    object.name = name;
    object.kind = map.text("kind", name);
    const Rgb colour = read_colour(map, colours().at("grey"));
    for (std::size_t i = 0; i < map.count("shapes"); ++i) {
      double share = 1;
      object.shapes.push_back(read_shape(map.item("shapes", i), colour, folder, map, share));
      object.shapes.back().mass_kg = share;
    }
    if (object.shapes.empty()) map.complain("shapes", "must list at least one shape");
    if (object.shapes.size() > kMostShapes) {
      map.complain("shapes", "lists " + std::to_string(object.shapes.size()) + "; allowed are at most " +
                                 std::to_string(kMostShapes));
    }
    if (map.ok()) set_mass(object, 0.1);
    return object;
  }

  void read_table(YamlReader map, YamlReader& parent) {
    map.allow({"top_center_m", "size_m", "thickness_m", "friction", "colour", "texture"});
    const Eigen::Vector3d top = map.vector("top_center_m", {-0.4, 0, -0.0826}, -kFarthest_m, kFarthest_m);
    const std::vector<double> size = map.numbers("size_m", {0.4, 0.7}, 2, 2, 0.05, kLargest_m);
    const double thickness = map.number("thickness_m", 0.03, 0.005, 0.5);
    const Rgb rgb = read_colour(map, colours().at("wood"));
    const std::string texture = map.text("texture", "wood");
    ObjectDescription table;
    table.name = "table";
    table.kind = "table";
    table.is_static = true;
    table.surface.friction = map.number("friction", 0.7, 0, 10);
    table.surface.restitution = 0.1;
    table.surface.rolling_m = 0.0005;
    const auto add = [&](const Eigen::Vector3d& edges, const Eigen::Vector3d& center) {
      PlacedShape shape;
      shape.shape.kind = ShapeKind::kBox;
      shape.shape.size = edges;
      shape.shape.rgba = {rgb[0], rgb[1], rgb[2], 1};
      shape.shape.texture = texture;
      shape.X_OwnerShape.translation() = center;
      shape.mass_kg = 1;
      table.shapes.push_back(shape);
    };
    // object frame: middle of the upper surface
    add({size[0], size[1], thickness}, {0, 0, -thickness / 2});
    const double leg = top.z() - thickness - Simulation::kFloorHeight_m;
    if (leg > 0.01) {
      for (const double sx : {-1.0, 1.0}) {
        for (const double sy : {-1.0, 1.0}) {
          add({0.03, 0.03, leg},
              {sx * (size[0] / 2 - 0.03), sy * (size[1] / 2 - 0.03), -thickness - leg / 2});
        }
      }
    }
    table.X_WorldObject.translation() = top;
    table_height_m = top.z();
    world.objects.push_back(table);
    parent.adopt(map);
  }

  void read_posture(YamlReader map, YamlReader& parent) {
    map.allow({"head", "torso", "left_arm", "right_arm", "left_leg", "right_leg"});
    for (const char* part : {"head", "torso", "left_arm", "right_arm", "left_leg", "right_leg"}) {
      std::vector<double> angles = map.numbers(part, {}, 1, 16, -360, 360);
      if (angles.empty()) continue;
      for (double& angle : angles) angle *= kDegree;
      world.posture_rad.emplace_back(part, angles);
    }
    parent.adopt(map);
  }

  // The object file that an entry names, or the shapes that it lists itself.
  Result<ObjectDescription> read_kind(YamlReader& map) {
    const std::string type = map.text("object", "");
    const bool own = map.has("kind") || map.has("shapes");
    if (type.empty() == !own) {
      map.complain(nullptr,
                   "needs object (the name of a file of config/objects), or kind and shapes of its own");
    }
    if (!map.ok()) return Error{ErrorCode::kInvalidArgument, map.trouble()};
    if (own) {
      ObjectDescription object = read_shapes(map, map.text("kind", "thing"), folder);
      if (!map.ok()) return Error{ErrorCode::kInvalidArgument, map.trouble()};
      return object;
    }
    auto read = read_object_file(type);
    if (!read) {
      map.complain("object", "cannot be used: " + read.error().message);
      return Error{read.error().code, map.trouble()};
    }
    return read;
  }

  void read_light(YamlReader map, YamlReader& parent) {
    map.allow({"brightness", "key", "fill", "ambient", "shadows", "direction"});
    Lighting light;
    light.brightness = map.number("brightness", light.brightness, 0, kBrightest);
    light.key = map.number("key", light.key, 0, kBrightest);
    light.fill = map.number("fill", light.fill, 0, kBrightest);
    light.ambient = map.number("ambient", light.ambient, 0, kBrightest);
    light.shadows = map.flag("shadows", light.shadows);
    light.key_direction_World = map.vector("direction", light.key_direction_World, -1000, 1000);
    if (light.key_direction_World.norm() < 1e-6) map.complain("direction", "has no length");
    world.light = light;
    parent.adopt(map);
  }

  // the names are looked up when all objects are there
  void read_joint(YamlReader map, YamlReader& parent) {
    map.allow({"kind", "between", "at_m", "axis"});
    ObjectJointDescription joint;
    const std::string kind = map.choice("kind", "ball", {"ball", "hinge", "fixed"});
    joint.kind = kind == "hinge"   ? ObjectJointKind::kHinge
                 : kind == "fixed" ? ObjectJointKind::kFixed
                                   : ObjectJointKind::kBall;
    const std::vector<std::string> between = map.names("between");
    if (between.size() == 2) {
      joint.a = between[0];
      joint.b = between[1];
    } else {
      map.complain("between", "names two objects, or one and world");
    }
    joint.p_World_m = map.vector("at_m", joint.p_World_m, -kFarthest_m, kFarthest_m);
    joint.axis_World = map.vector("axis", joint.axis_World, -1000, 1000);
    world.joints.push_back(joint);
    parent.adopt(map);
  }

  Status read_object(YamlReader map) {
    map.allow({"object", "name", "colour", "position_m", "yaw_deg", "rpy_deg", "static", "touches_robot",
               "mass_kg", "friction", "restitution", "rolling_m", "kind", "shapes"});
    auto read = read_kind(map);
    if (!read) return read.error();
    ObjectDescription object = std::move(*read);
    object.name = map.text("name", object.name);
    if (object.name.empty() || object.name.size() > 60) map.complain("name", "has 1 to 60 characters");
    if (std::any_of(world.objects.begin(), world.objects.end(),
                    [&](const auto& o) { return o.name == object.name; })) {
      map.complain("name", "\"" + object.name + "\" is taken by another object");
    }
    if (map.has("colour")) {
      const Rgb rgb = read_colour(map, {1, 1, 1});
      for (PlacedShape& s : object.shapes) std::copy(rgb.begin(), rgb.end(), s.shape.rgba.begin());
    }
    read_common(map, object);
    Eigen::Vector3d rpy = map.vector("rpy_deg", Eigen::Vector3d::Zero(), -360, 360);
    if (map.has("yaw_deg")) rpy.z() = map.number("yaw_deg", 0, -360, 360);
    object.X_WorldObject.linear() = from_rpy_deg(rpy);
    if (!map.has("position_m")) map.complain(nullptr, "needs position_m");
    const std::vector<double> p = map.numbers("position_m", {0, 0}, 2, 3, -kFarthest_m, kFarthest_m);
    const double z =
        p.size() == 3 ? p[2] : table_height_m + standing_height(object, object.X_WorldObject.linear());
    object.X_WorldObject.translation() = Eigen::Vector3d(p[0], p[1], z);
    if (!map.ok()) return Error{ErrorCode::kInvalidArgument, map.trouble()};
    world.objects.push_back(std::move(object));
    return {};
  }

  // "blue cube": the file cube in blue; "teddy bear": the file bear as it is
  Result<ObjectDescription> named(const std::string& name) {
    const std::size_t space = name.rfind(' ');
    auto read = read_object_file(space == std::string::npos ? name : name.substr(space + 1));
    if (!read) {
      return Error{read.error().code, "no object \"" + name + "\" is known: " + read.error().message};
    }
    ObjectDescription object = std::move(*read);
    object.name = name;
    if (space != std::string::npos) {
      const auto colour = colours().find(name.substr(0, space));
      if (colour != colours().end()) {
        for (PlacedShape& s : object.shapes) {
          std::copy(colour->second.begin(), colour->second.end(), s.shape.rgba.begin());
        }
      }
    }
    return object;
  }

  Status read(YamlReader map) {
    map.allow({"table", "posture_deg", "light", "objects", "joints", "random"});
    if (map.has("posture_deg")) read_posture(map.child("posture_deg"), map);
    if (map.has("light")) read_light(map.child("light"), map);
    if (map.has("table")) read_table(map.child("table"), map);
    if (!map.ok()) return Error{ErrorCode::kInvalidArgument, map.trouble()};
    for (std::size_t i = 0; i < map.count("objects"); ++i) {
      if (Status done = read_object(map.item("objects", i)); !done) return done;
    }
    if (!map.ok()) return Error{ErrorCode::kInvalidArgument, map.trouble()};
    for (std::size_t i = 0; i < map.count("joints"); ++i) read_joint(map.item("joints", i), map);
    if (!map.ok()) return Error{ErrorCode::kInvalidArgument, map.trouble()};
    if (map.has("random")) {
      return place_at_random(
          map.child("random"), options, table_height_m,
          [this](const std::string& name) { return named(name); }, world.objects);
    }
    if (options.target.empty() || std::any_of(world.objects.begin(), world.objects.end(),
                                              [&](const auto& o) { return o.name == options.target; })) {
      return {};
    }
    return Error{ErrorCode::kInvalidArgument,
                 "the world has no object \"" + options.target + "\" and no random section"};
  }
};

}  // namespace

ObjectDescription make_simple(const std::string& name, const std::string& kind, ShapeKind shape,
                              const Eigen::Vector3d& size, double mass_kg, const std::array<float, 3>& rgb) {
  ObjectDescription object;
  object.name = name;
  object.kind = kind;
  PlacedShape placed;
  placed.shape.kind = shape;
  placed.shape.size = size;
  placed.shape.rgba = {rgb[0], rgb[1], rgb[2], 1};
  placed.mass_kg = mass_kg;
  object.shapes.push_back(placed);
  if (shape == ShapeKind::kSphere) object.surface.rolling_m = 0.0015;
  return object;
}

double standing_height(const ObjectDescription& object, const Eigen::Matrix3d& R_WorldObject) {
  Eigen::AlignedBox3d box;
  for (PlacedShape shape : object.shapes) {
    shape.X_OwnerShape = Eigen::Isometry3d(Eigen::Quaterniond(R_WorldObject)) * shape.X_OwnerShape;
    extend_bounds(shape, box);
  }
  return -box.min().z();
}

Result<WorldDescription> read_world(const SimulationOptions& options) {
  WorldReader reader{options, {}, {}, {}};
  reader.folder = options.world_path.parent_path();
  reader.objects_folder = options.urdf_path.parent_path().parent_path() / "objects";
  std::string file = "world";
  YAML::Node node;
  try {
    if (!options.world_path.empty()) {
      file = options.world_path.string();
      std::error_code trouble;
      if (!std::filesystem::is_regular_file(options.world_path, trouble)) {
        return Error{ErrorCode::kNotFound, "cannot read the world " + file};
      }
      const std::filesystem::path beside = options.world_path.parent_path() / ".." / "objects";
      if (std::filesystem::is_directory(beside, trouble)) reader.objects_folder = beside.lexically_normal();
      node = YAML::LoadFile(file);
    } else if (!options.world_yaml.empty()) {
      node = YAML::Load(options.world_yaml);
    } else {
      return reader.world;
    }
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument, file + ": " + e.what()};
  }
  if (Status done = reader.read(YamlReader(node, file, "")); !done) return done.error();
  return reader.world;
}

}  // namespace nido::sim
