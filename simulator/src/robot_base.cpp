#include "robot_base.h"

#include <limits>

#include "nido/simulator/simulation.h"

namespace nido::sim {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();
constexpr const char* kStand = "stand";  // its name and its kind

}  // namespace

void free_base(RobotDescription& robot) {
  static constexpr std::array<const char*, kBaseDegrees> kNames = {
      "base_x", "base_y", "base_z", "base_turn_x", "base_turn_y", "base_turn_z"};
  std::vector<LinkDescription> links(1);
  links[0].name = "world";
  for (std::size_t i = 0; i < kBaseDegrees; ++i) {
    LinkDescription degree;
    if (i + 1 == kBaseDegrees) degree = std::move(robot.links[0]);
    degree.freedom = i + 1 < kFirstBaseTurn ? Freedom::kBaseSlide : Freedom::kBaseTurn;
    degree.parent = static_cast<int>(i);
    if (i + 1 < kBaseDegrees) degree.name = kNames[i];
    degree.joint_name = kNames[i];
    degree.axis_Link = Eigen::Vector3d::Unit(static_cast<Eigen::Index>(i % 3));
    degree.min_rad = -kUnlimited;
    degree.max_rad = kUnlimited;
    links.push_back(std::move(degree));
  }
  for (std::size_t i = 1; i < robot.links.size(); ++i) {
    links.push_back(std::move(robot.links[i]));
    links.back().parent += static_cast<int>(kBaseDegrees);
  }
  robot.links = std::move(links);
}

Result<WorldDescription> read_world_with_base(const SimulationOptions& options,
                                              const RobotDescription& robot) {
  auto world = read_world(options);
  if (!world || options.base != Base::kStand) return world;
  for (const ObjectDescription& object : world->objects) {
    if (object.kind == kStand) return world;  // a scene that was saved with it
    if (object.name == kStand) {
      return Error{ErrorCode::kInvalidArgument,
                   options.world_path.string() +
                       ": the object \"stand\" has the name of what holds the robot; "
                       "give it another one, or the robot a base that is not stand"};
    }
  }
  world->objects.push_back(make_stand(robot));
  return world;
}

ObjectDescription make_stand(const RobotDescription& robot) {
  Eigen::AlignedBox3d root;
  for (const LinkShape& shape : robot.links[0].collisions) extend_bounds(shape.placed, root);
  if (root.isEmpty()) root.extend(Eigen::Vector3d::Zero());
  constexpr double kArm_m = 0.16;    // from the root's back to the pole's middle: legs swing in front of it
  constexpr double kBeam_m = 0.04;   // the arm's thickness
  constexpr double kPlate_m = 0.02;  // the plate's
  const double floor_m = Simulation::kFloorHeight_m;
  const Eigen::Vector3d middle = root.center();
  const double back_m = root.max().x();
  const double pole_x_m = back_m + kArm_m;
  const double top_m = middle.z() + kBeam_m / 2;

  ObjectDescription stand;
  stand.name = stand.kind = kStand;
  stand.is_static = true;
  stand.surface.friction = 0.5;
  const auto add = [&stand](ShapeKind kind, const Eigen::Vector3d& size, const Eigen::Vector3d& p_World_m) {
    PlacedShape placed;
    placed.shape.kind = kind;
    placed.shape.size = size;
    placed.shape.rgba = {0.25F, 0.26F, 0.28F, 1};
    placed.shape.shininess = 0.4F;
    placed.X_OwnerShape.translation() = p_World_m;
    placed.mass_kg = 1;
    stand.shapes.push_back(placed);
  };
  // heels reach back as far as the root does
  add(ShapeKind::kBox, {0.34, 0.36, kPlate_m}, {back_m + 0.19, middle.y(), floor_m + kPlate_m / 2});
  add(ShapeKind::kCylinder, {0.022, top_m - floor_m, 0}, {pole_x_m, middle.y(), (top_m + floor_m) / 2});
  add(ShapeKind::kBox, {kArm_m, kBeam_m, kBeam_m}, {back_m + kArm_m / 2, middle.y(), middle.z()});
  return stand;
}

}  // namespace nido::sim
