// Snapshots as JSON: a line here for everything that a state is made of.
#include <array>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "simulation_state.h"

// Vectors as lists, rotations and matrices row by row.
namespace nlohmann {

template <int Rows, int Columns>
struct adl_serializer<Eigen::Matrix<double, Rows, Columns>> {
  using Matrix = Eigen::Matrix<double, Rows, Columns>;
  static void to_json(json& j, const Matrix& m) {
    j = json::array();
    for (int r = 0; r < Rows; ++r) {
      for (int c = 0; c < Columns; ++c) j.push_back(m(r, c));
    }
  }
  static void from_json(const json& j, Matrix& m) {
    const auto values = j.get<std::array<double, static_cast<std::size_t>(Rows * Columns)>>();
    for (int r = 0; r < Rows; ++r) {
      for (int c = 0; c < Columns; ++c) m(r, c) = values[static_cast<std::size_t>(r * Columns + c)];
    }
  }
};

template <>
struct adl_serializer<Eigen::Isometry3d> {
  static void to_json(json& j, const Eigen::Isometry3d& X) {
    const Eigen::Vector3d p = X.translation();
    const Eigen::Matrix3d R = X.linear();
    j = json{{"p_m", p}, {"R", R}};
  }
  static void from_json(const json& j, Eigen::Isometry3d& X) {
    X = Eigen::Isometry3d::Identity();
    X.translation() = j.at("p_m").get<Eigen::Vector3d>();
    X.linear() = j.at("R").get<Eigen::Matrix3d>();
  }
};

}  // namespace nlohmann

namespace nido::sim {

using nlohmann::json;

NLOHMANN_JSON_SERIALIZE_ENUM(ShapeKind, {{ShapeKind::kBox, "box"},
                                         {ShapeKind::kSphere, "sphere"},
                                         {ShapeKind::kCylinder, "cylinder"},
                                         {ShapeKind::kCapsule, "capsule"},
                                         {ShapeKind::kMesh, "mesh"}})
NLOHMANN_JSON_SERIALIZE_ENUM(JointMode, {{JointMode::kIdle, "idle"},
                                         {JointMode::kPosition, "position"},
                                         {JointMode::kDirect, "direct"},
                                         {JointMode::kVelocity, "velocity"},
                                         {JointMode::kTorque, "torque"},
                                         {JointMode::kPwm, "pwm"}})
NLOHMANN_JSON_SERIALIZE_ENUM(CameraFault, {{CameraFault::kNone, "none"},
                                           {CameraFault::kStuck, "stuck"},
                                           {CameraFault::kOff, "off"},
                                           {CameraFault::kNoise, "noise"},
                                           {CameraFault::kSlow, "slow"}})
NLOHMANN_JSON_SERIALIZE_ENUM(JointFault, {{JointFault::kNone, "none"},
                                          {JointFault::kWeak, "weak"},
                                          {JointFault::kOff, "off"},
                                          {JointFault::kStuck, "stuck"}})
NLOHMANN_JSON_SERIALIZE_ENUM(SkinFault, {{SkinFault::kNone, "none"},
                                         {SkinFault::kStuck, "stuck"},
                                         {SkinFault::kOff, "off"}})

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Surface, friction, restitution, rolling_m)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(VisualShape, kind, size, mesh_path, rgba, texture, shininess)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PlacedShape, shape, X_OwnerShape, mass_kg)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ObjectDescription, name, kind, is_static, touches_robot, surface, shapes,
                                   X_WorldObject)
// a push at the centre of mass says nothing of a point in older files
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ObjectBody::Push, force_World_N, torque_World_Nm, left_s,
                                                p_ComPoint_Body_m)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ObjectBody::Motion, X_WorldObject, position, quaternion, rotation,
                                   velocity, angular_velocity, enabled, quiet_s, push)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RobotTree::State, angle_rad, speed_rad_s, at_torque)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RobotBody::State, tree, awake)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(JointState, position_rad, velocity_rad_s, torque_Nm, target,
                                   reference_speed_rad_s, reference_rad, servo_gain_1_s, home_rad, mode,
                                   motion_done)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Trajectory, age, duration_s, coefficient)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(AxisState, measured, reference_rad, reference_velocity_rad_s,
                                   previous_reference_rad, fault, held_rad, at_limit, trajectory)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Drives::State, axes, applied_torque_Nm)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(HandTouch, on, force_N)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TaxelForce, value, force_N)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Skin::State, touch, fault)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ContactSolver::Side, link, object)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Contacts::Grip, robot_geom, object, p_LinkAnchor_m, p_ObjectAnchor_m)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Contacts::Load, a, b, robot_geom, p_World_m, force_World_N,
                                   torque_World_Nm)
NLOHMANN_JSON_SERIALIZE_ENUM(Contacts::OwnerKind, {{Contacts::OwnerKind::kFloor, "floor"},
                                                   {Contacts::OwnerKind::kLink, "link"},
                                                   {Contacts::OwnerKind::kObject, "object"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Contacts::Owner, kind, index)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Contacts::Touching, a, b, robot_geom, robot_geom_b, p_World_m, depth_m,
                                   force_N)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Contacts::State, touch, skin_fault, skin, grips, loads, touching)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Simulation::Wrench, force_N, torque_Nm)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LimbForces::Motion, momentum, turn_momentum)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LimbForces::State, before, wrenches)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Lighting, brightness, key, fill, ambient, key_direction_World, shadows)
NLOHMANN_JSON_SERIALIZE_ENUM(ObjectJointKind, {{ObjectJointKind::kBall, "ball"},
                                               {ObjectJointKind::kHinge, "hinge"},
                                               {ObjectJointKind::kFixed, "fixed"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ObjectJoint, kind, a, b, X_AJoint, X_BJoint, impulse)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SimulationState, period, moment, robot, objects, drives, contacts,
                                   head_velocity, limb_forces, camera_fault, light, joints)

// pictures are lists of numbers: broken eyes are rare, and files of older versions have none
void to_json(json& j, const Film& film) {
  const Image* picture = picture_on(film);
  j = json{{"fault", film.fault},
           {"taken", film.taken},
           {"width", picture == nullptr ? 0 : film.width},
           {"height", picture == nullptr ? 0 : film.height},
           {"rgb", picture == nullptr ? std::vector<std::uint8_t>() : picture->rgb}};
}

void from_json(const json& j, Film& film) {
  j.at("fault").get_to(film.fault);
  j.at("taken").get_to(film.taken);
  j.at("width").get_to(film.width);
  j.at("height").get_to(film.height);
  Image picture;
  j.at("rgb").get_to(picture.rgb);
  picture.width = film.width;
  picture.height = film.height;
  std::promise<Image> drawn;
  film.shown = drawn.get_future().share();
  drawn.set_value(std::move(picture));
}

namespace {

constexpr const char* kFormat = "nido snapshot 2";

bool is_pose(const Eigen::Isometry3d& X) {
  return X.translation().cwiseAbs().maxCoeff() < 1e4 &&
         (X.linear().transpose() * X.linear() - Eigen::Matrix3d::Identity()).norm() < 1e-6 &&
         X.linear().determinant() > 0;
}

// The first thing about an object that no object may have; empty: none.
std::string trouble_of(const ObjectDescription& object) {
  constexpr double kSmallest = 1e-6;
  constexpr double kLargest = 1e3;
  if (object.name.empty() || object.name.size() > 60) return "a name has 1 to 60 characters";
  if (object.shapes.empty() || object.shapes.size() > 64) return "an object has 1 to 64 shapes";
  if (!is_pose(object.X_WorldObject)) return "its pose is none";
  const Surface& s = object.surface;
  if (!(s.friction >= 0 && s.friction <= 10 && s.restitution >= 0 && s.restitution <= 1 && s.rolling_m >= 0 &&
        s.rolling_m <= 0.1))
    return "its surface is none";
  for (const PlacedShape& placed : object.shapes) {
    const Eigen::Vector3d& size = placed.shape.size;
    const int sizes = placed.shape.kind == ShapeKind::kSphere                                         ? 1
                      : placed.shape.kind == ShapeKind::kBox || placed.shape.kind == ShapeKind::kMesh ? 3
                                                                                                      : 2;
    for (int i = 0; i < sizes; ++i) {
      if (!(size[i] >= kSmallest && size[i] <= kLargest)) return "a shape's size is none";
    }
    if (!is_pose(placed.X_OwnerShape)) return "a shape's pose is none";
    if (!(placed.mass_kg > 0 && placed.mass_kg <= 1e4)) return "a shape's mass is none";
  }
  return {};
}

// A side of something that touches is there: the floor, an object, or a shape of the robot.
bool is_side(const Contacts::Owner& owner, int robot_geom, const WorldSnapshot& snapshot,
             const StateShape& shape) {
  if (owner.kind == Contacts::OwnerKind::kFloor) return true;
  if (owner.kind == Contacts::OwnerKind::kObject) return owner.index < snapshot.objects.size();
  return robot_geom >= 0 && static_cast<std::size_t>(robot_geom) < shape.shape_links.size() &&
         shape.shape_links[static_cast<std::size_t>(robot_geom)] == owner.index;
}

// The first thing in which the state does not fit; empty: it fits.
std::string trouble_of(const WorldSnapshot& snapshot, const StateShape& shape) {
  const SimulationState& s = snapshot.state;
  const std::size_t links = shape.hinges.size() + 1;
  if (s.robot.tree.angle_rad.size() != links || s.robot.tree.speed_rad_s.size() != links ||
      s.robot.tree.at_torque.size() != links || s.robot.awake.size() != links ||
      s.drives.applied_torque_Nm.size() != links || s.limb_forces.before.size() != links)
    return "the robot's state is not of " + std::to_string(links) + " links";
  if (s.drives.axes.size() != shape.joints)
    return "the drives' state is not of " + std::to_string(shape.joints) + " joints";
  if (s.limb_forces.wrenches.size() != shape.sensors)
    return "the state is not of " + std::to_string(shape.sensors) + " force/torque sensors";
  const Skin::State& skin = s.contacts.skin;
  if (skin.touch.size() != shape.skin_values.size() || skin.fault.size() != shape.skin_values.size())
    return "the state is not of " + std::to_string(shape.skin_values.size()) + " patches of skin";
  for (std::size_t patch = 0; patch < skin.touch.size(); ++patch) {
    for (const TaxelForce& taxel : skin.touch[patch]) {
      if (taxel.value < 0 || static_cast<std::size_t>(taxel.value) >= shape.skin_values[patch])
        return "a taxel of the skin is none";
    }
  }
  if (s.objects.size() != snapshot.objects.size()) return "objects and their motions are not as many";
  if (s.period < 0) return "its time is before the start";
  for (const ObjectDescription& object : snapshot.objects) {
    const std::string trouble = trouble_of(object);
    if (!trouble.empty()) return "object \"" + object.name + "\": " + trouble;
  }
  constexpr int kLargestPicture_px = 4096;
  constexpr int kMostTaken = 1'000'000'000;
  for (const Film& film : s.films) {
    const Image* picture = picture_on(film);
    if (film.taken < 0 || film.taken > kMostTaken || film.width < 0 || film.width > kLargestPicture_px ||
        film.height < 0 || film.height > kLargestPicture_px ||
        (picture != nullptr &&
         picture->rgb.size() != std::size_t{3} * static_cast<unsigned>(film.width * film.height)))
      return "the picture of a broken eye is none";
  }
  const int count = static_cast<int>(snapshot.objects.size());
  for (const Contacts::Touching& touching : s.contacts.touching) {
    if (!is_side(touching.a, touching.robot_geom, snapshot, shape) ||
        !is_side(touching.b, touching.robot_geom_b, snapshot, shape))
      return "something touches what is not there";
  }
  for (const ObjectJoint& joint : s.joints) {
    if (joint.a < 0 || joint.a >= count || joint.b < -1 || joint.b >= count || joint.a == joint.b ||
        !is_pose(joint.X_AJoint) || !is_pose(joint.X_BJoint))
      return "a joint between objects is none";
  }
  for (const ObjectBody::Motion& motion : s.objects) {
    double norm = 0;
    for (const double q : motion.quaternion) norm += q * q;
    // static objects have none
    if (norm != 0 && std::abs(norm - 1) > 1e-6) return "an object's orientation is none";
  }
  return {};
}

}  // namespace

std::string snapshot_text(const WorldSnapshot& snapshot, const StateShape& shape) {
  const json file = {{"format", kFormat},
                     {"hinges", shape.hinges},
                     {"objects", snapshot.objects},
                     {"state", snapshot.state},
                     {"films", snapshot.state.films}};
  return file.dump() + "\n";
}

std::string hash_word(std::uint64_t hash) {
  std::array<char, 17> word{};
  std::snprintf(word.data(), word.size(), "%016" PRIx64, hash);
  return word.data();
}

std::uint64_t hash_of(const WorldSnapshot& snapshot) {
  WorldSnapshot timeless = snapshot;
  timeless.state.period = 0;
  const json all = {{"objects", timeless.objects}, {"state", timeless.state}};
  std::uint64_t hash = 1469598103934665603ULL;
  for (const std::uint8_t byte : json::to_cbor(all)) hash = (hash ^ byte) * 1099511628211ULL;  // FNV-1a
  return hash;
}

Result<WorldSnapshot> read_snapshot(const std::string& text, const StateShape& shape,
                                    const std::string& source) {
  const auto refuse = [&source](const std::string& why) {
    return Error{ErrorCode::kInvalidArgument, source + ": " + why};
  };
  WorldSnapshot snapshot;
  try {
    const json file = json::parse(text);
    if (!file.is_object() || file.value("format", "") != kFormat)
      return refuse(std::string("is no snapshot: it does not begin with the format \"") + kFormat + "\"");
    if (file.at("hinges").get<std::vector<std::string>>() != shape.hinges)
      return refuse("is a snapshot of another robot: its hinges have other names");
    file.at("objects").get_to(snapshot.objects);
    file.at("state").get_to(snapshot.state);
    if (file.contains("films")) file.at("films").get_to(snapshot.state.films);
  } catch (const json::exception& e) {
    return refuse(e.what());
  }
  const std::string trouble = trouble_of(snapshot, shape);
  if (!trouble.empty()) return refuse(trouble);
  for (ObjectDescription& object : snapshot.objects) {
    for (PlacedShape& placed : object.shapes) {
      if (placed.shape.kind != ShapeKind::kMesh) continue;
      auto mesh = load_mesh(placed.shape.mesh_path, placed.shape.size);
      if (!mesh) return refuse(mesh.error().message);
      placed.mesh = *mesh;
    }
  }
  return snapshot;
}

}  // namespace nido::sim
