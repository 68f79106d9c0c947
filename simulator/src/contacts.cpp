#include "contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "ode_library.h"

namespace nido::sim {
namespace {

constexpr int kMostContactsOfPair = 8;
constexpr std::size_t kMostContacts = 1500;

// Rubber finger pads, and the robot's shells.
constexpr Surface kFingerSurface{1.8, 0.0, 0.0};
constexpr Surface kPalmSurface{1.2, 0.0, 0.0};
constexpr Surface kShellSurface{0.6, 0.0, 0.0};
constexpr Surface kFloorSurface{0.8, 0.2, 0.0005};

// A contact gives way like a spring with a damper, per contact point. Rubber on light objects must be soft,
// or the solver's twenty-odd iterations leave jitter; furniture is stiffer.
constexpr double kPadStiffness_N_m = 1.2e4;
constexpr double kPadDamping_Ns_m = 60;
constexpr double kFurnitureStiffness_N_m = 4e4;
constexpr double kFurnitureDamping_Ns_m = 150;
// Contact patch of a soft finger: resists turning about the normal with force times this arm.
constexpr double kPadTwistArm_m = 0.004;
constexpr double kStep_s = 0.001;
constexpr double kSlowestBounce_m_s = 0.05;
constexpr double kHardContact = 1e-6;  // ODE's softness of a contact that hardly gives way

// A grip: how fast a slip is undone, beyond which slip the contact slides, how far it may wander as a finger
// rolls, and how near two contacts of a pair must be to be the same one.
constexpr double kGripRate_1_s = 100;
constexpr double kMostSlip_m = 0.0005;
constexpr double kGripRadius_m = 0.002;
constexpr double kSameGrip_m = 0.005;

// Beyond what its speed takes a shape within a control period: what it may gain.
constexpr double kSelfMargin_m = 0.004;

bool overlap(const dReal* a, const dReal* b) {
  return a[0] <= b[1] && b[0] <= a[1] && a[2] <= b[3] && b[2] <= a[3] && a[4] <= b[5] && b[4] <= a[5];
}

Eigen::Vector3d point_velocity(dBodyID body, const Eigen::Vector3d& p_World_m) {
  if (body == nullptr) return Eigen::Vector3d::Zero();
  return to_eigen(dBodyGetLinearVel(body)) +
         to_eigen(dBodyGetAngularVel(body)).cross(p_World_m - to_eigen(dBodyGetPosition(body)));
}

bool awake(const ObjectBody& object) {
  return object.body() != nullptr && dBodyIsEnabled(object.body()) != 0;
}

}  // namespace

Contacts::Contacts(RobotBody& robot, const ControlBlock& block, std::vector<SkinPatch> patches)
    : floor_(dCreatePlane(nullptr, 0, 0, 1, Simulation::kFloorHeight_m)),
      robot_(robot),
      skin_(std::move(patches)) {
  for (const SkinPatch& patch : skin_.patches())
    X_PatchLink_.push_back(robot.find_frame(patch.link).X_LinkFrame.inverse());
  static constexpr std::array<const char*, 5> kFingers = {"thumb", "index", "middle", "ring", "little"};
  for (std::size_t i = 0; i < robot.link_count(); ++i) {
    for (const LinkShape& shape : robot.description().links[i].collisions) {
      RobotGeom part;
      part.link = i;
      part.name = shape.urdf_link;
      part.surface = kShellSurface;
      part.patch = skin_.patch_on(part.name);
      for (int hand = 0; hand < 2; ++hand) {
        const std::string prefix = hand == 0 ? "l_" : "r_";
        for (std::size_t f = 0; f < kFingers.size(); ++f) {
          if (part.name.starts_with(prefix + kFingers[f])) {
            part.hand = hand;
            part.finger = static_cast<int>(f);
            part.surface = kFingerSurface;
          }
        }
        for (std::size_t p = 0; p < block.hands[hand].pads.size(); ++p) {
          if (part.name != block.hands[hand].pads[p]) continue;
          part.hand = hand;
          part.finger = static_cast<int>(p);
          part.pad = true;
          if (p == 5) part.surface = kPalmSurface;
        }
      }
      part.geom = make_geom(shape.placed, mesh_data_);
      if (part.geom == nullptr) continue;
      const auto place = [&](dGeomID geom, const Eigen::Isometry3d& X_LinkShape) {
        Eigen::Isometry3d X = X_LinkShape;
        if (i != 0) X.translation() -= robot.description().links[i].mass.center_m;
        place_geom(geom, robot.bodies()[i], X);
      };
      place(part.geom, shape.placed.X_OwnerShape);
      if (shape.placed.shape.kind == ShapeKind::kCapsule) {
        const double half = shape.placed.shape.size.y() / 2;
        const std::array<double, 3> along = {-half, half, 0};
        for (std::size_t s = 0; s < along.size(); ++s) {
          part.spheres[s] = dCreateSphere(nullptr, shape.placed.shape.size.x());
          place(part.spheres[s], shape.placed.X_OwnerShape * Eigen::Translation3d(0, 0, along[s]));
        }
      }
      robot_geoms_.push_back(part);
    }
  }
}

Contacts::~Contacts() {
  dGeomDestroy(floor_);
  for (RobotGeom& part : robot_geoms_) {
    dGeomDestroy(part.geom);
    for (dGeomID sphere : part.spheres) {
      if (sphere != nullptr) dGeomDestroy(sphere);
    }
  }
  for (dTriMeshDataID data : mesh_data_) dGeomTriMeshDataDestroy(data);
}

bool Contacts::collide(dGeomID geom_a, dGeomID geom_b, const Side& a, const Side& b, std::size_t first,
                       double apart_m) {
  std::array<dContactGeom, kMostContactsOfPair> found;
  const int count = dCollide(geom_a, geom_b, kMostContactsOfPair, found.data(), sizeof(dContactGeom));
  bool any = false;
  for (int i = 0; i < count && touching_.size() < kMostContacts; ++i) {
    const dContactGeom& geometry = found[i];
    const Eigen::Vector3d p = to_eigen(geometry.pos);
    const Eigen::Vector3d normal = to_eigen(geometry.normal);
    if (!p.allFinite() || !normal.allFinite() || std::abs(normal.squaredNorm() - 1) > 0.01) continue;
    bool near = false;
    for (std::size_t k = first; k < touching_.size() && apart_m > 0; ++k) {
      near = near || (touching_[k].p_World_m - p).squaredNorm() < apart_m * apart_m;
    }
    if (near) continue;

    const bool pad = a.robot_geom >= 0 && robot_geoms_[a.robot_geom].finger >= 0;
    ContactSolver::Contact contact;
    const auto side = [](const Side& from) {
      ContactSolver::Side to;
      if (from.owner.kind == OwnerKind::kLink) to.link = static_cast<int>(from.owner.index);
      if (from.owner.kind == OwnerKind::kObject) to.object = static_cast<int>(from.owner.index);
      return to;
    };
    contact.a = side(a);
    contact.b = side(b);
    contact.p_World_m = p;
    contact.normal_World = normal.normalized();
    contact.depth_m = geometry.depth;
    contact.friction = std::sqrt(a.surface->friction * b.surface->friction);
    const double stiffness = pad ? kPadStiffness_N_m : kFurnitureStiffness_N_m;
    const double damping = pad ? kPadDamping_Ns_m : kFurnitureDamping_Ns_m;
    contact.erp = kStep_s * stiffness / (kStep_s * stiffness + damping);
    contact.cfm = 1 / (kStep_s * stiffness + damping);
    contact.restitution = std::min(a.surface->restitution, b.surface->restitution);
    contact.slowest_bounce_m_s = kSlowestBounce_m_s;
    if (contact.restitution > 0) {
      // what gives way does not bounce: at the moment of the impact the contact is hard
      const Eigen::Vector3d closing = point_velocity(b.body, p) - point_velocity(a.body, p);
      if (normal.dot(closing) > kSlowestBounce_m_s) {
        contact.cfm = kHardContact;
        contact.erp = 0;
      }
    }
    if (pad) {
      contact.twist_m = kPadTwistArm_m;
    } else if (a.robot_geom < 0 &&
               (dGeomGetClass(geom_a) == dSphereClass || dGeomGetClass(geom_b) == dSphereClass)) {
      contact.rolling_m = a.surface->rolling_m + b.surface->rolling_m;
      contact.twist_m = contact.rolling_m;
    }
    if (a.robot_geom >= 0 && robot_geoms_[a.robot_geom].hand >= 0 && a.body != nullptr && b.body != nullptr &&
        b.owner.kind == OwnerKind::kObject) {
      stick(contact, a, b);
    }
    load(contact, a.robot_geom);
    solved_.push_back(contact);
    touching_.push_back({a.owner, b.owner, a.robot_geom, b.robot_geom, p, geometry.depth, 0});
    any = true;
  }
  return any;
}

std::vector<Contacts::Load> Contacts::loads() const {
  if (loads_restored_) return former_loads_;
  std::vector<Load> made;
  for (std::size_t i = 0; i < solved_.size(); ++i) {
    const ContactSolver::Contact& c = solved_[i];
    made.push_back({c.a, c.b, touching_[i].robot_geom, c.p_World_m, c.force_World_N, c.torque_World_Nm});
  }
  return made;
}

void Contacts::load(ContactSolver::Contact& contact, int robot_geom) {
  // contacts come in the same order as in the step before, but for those that are new
  constexpr std::size_t kNear = 24;
  const std::size_t count = former_loads_.size();
  double nearest = kSameGrip_m;
  std::size_t found = count;
  for (std::size_t i = 0; i < std::min(kNear, count); ++i) {
    const std::size_t k = (next_load_ + count + i - std::min(kNear, count) / 2) % count;
    const Load& load = former_loads_[k];
    if (load.a.link != contact.a.link || load.a.object != contact.a.object || load.b.link != contact.b.link ||
        load.b.object != contact.b.object || load.robot_geom != robot_geom)
      continue;
    const double distance = (load.p_World_m - contact.p_World_m).norm();
    if (distance >= nearest) continue;
    nearest = distance;
    found = k;
  }
  if (found == count) return;
  contact.force_World_N = former_loads_[found].force_World_N;
  contact.torque_World_Nm = former_loads_[found].torque_World_Nm;
  former_loads_[found].a = former_loads_[found].b = {-1, -1};  // each is taken once
  next_load_ = found + 1;
}

void Contacts::stick(ContactSolver::Contact& contact, const Side& hand, const Side& object) {
  const Eigen::Isometry3d X_WorldLink = body_pose(hand.body);
  const Eigen::Isometry3d X_WorldObject = body_pose(object.body);
  const Eigen::Vector3d& normal = contact.normal_World;
  const Eigen::Vector3d& p = contact.p_World_m;

  // the grip of the step before that was here
  const Grip* former = nullptr;
  double nearest = kSameGrip_m;
  for (const Grip& grip : former_grips_) {
    if (grip.robot_geom != hand.robot_geom || grip.object != object.owner.index) continue;
    const double distance = (X_WorldObject * grip.p_ObjectAnchor_m - p).norm();
    if (distance < nearest) {
      nearest = distance;
      former = &grip;
    }
  }
  Eigen::Vector3d slip = Eigen::Vector3d::Zero();
  Grip grip;
  grip.robot_geom = hand.robot_geom;
  grip.object = object.owner.index;
  if (former != nullptr) {
    grip = *former;
    slip = X_WorldLink * grip.p_LinkAnchor_m - X_WorldObject * grip.p_ObjectAnchor_m;
    slip -= normal * normal.dot(slip);
  }
  const bool slides = slip.norm() > kMostSlip_m;
  if (slides) slip *= kMostSlip_m / slip.norm();
  if (former == nullptr || slides || nearest > kGripRadius_m) {
    // takes hold here, keeping the slip that is still to be undone
    grip.p_LinkAnchor_m = X_WorldLink.inverse() * (p + slip / 2);
    grip.p_ObjectAnchor_m = X_WorldObject.inverse() * (p - slip / 2);
  }
  grips_.push_back(grip);
  const double length = slip.norm();
  if (length < 1e-9) return;
  contact.tangent_World = slip / length;
  contact.tangent_speed_m_s = -kGripRate_1_s * length;
}

bool Contacts::collide_robot(const RobotGeom& part, const Side& robot, dGeomID geom, const Side& object) {
  const std::size_t first = touching_.size();
  bool any = false;
  const int kind = dGeomGetClass(geom);
  const bool capsule = part.spheres[0] != nullptr;
  // ODE has no capsule against cylinder, and gives one point for a capsule that lies along a box's face
  if (!capsule || kind != dCylinderClass) any = collide(part.geom, geom, robot, object, first, 0);
  if (capsule && (kind == dCylinderClass || (kind == dBoxClass && any))) {
    const double apart_m = 0.004;
    for (std::size_t s = 0; s < (kind == dCylinderClass ? 3U : 2U); ++s) {
      any = collide(part.spheres[s], geom, robot, object, first, apart_m) || any;
    }
  }
  return any;
}

bool Contacts::collide_objects(const ObjectBody& a, std::size_t index_a, const ObjectBody& b,
                               std::size_t index_b) {
  const Side side_a{{OwnerKind::kObject, index_a}, &a.description().surface, a.body(), -1};
  const Side side_b{{OwnerKind::kObject, index_b}, &b.description().surface, b.body(), -1};
  bool any = false;
  for (dGeomID geom_a : a.geoms()) {
    dReal box_a[6];
    dGeomGetAABB(geom_a, box_a);
    for (dGeomID geom_b : b.geoms()) {
      dReal box_b[6];
      dGeomGetAABB(geom_b, box_b);
      if (overlap(box_a, box_b)) any = collide(geom_a, geom_b, side_a, side_b, touching_.size(), 0) || any;
    }
  }
  return any;
}

void Contacts::find(const Objects& objects, const std::vector<ObjectJoint>& joints, double step_s) {
  former_loads_ = loads();
  loads_restored_ = false;
  next_load_ = 0;
  touching_.clear();
  solved_.clear();
  former_grips_.swap(grips_);
  grips_.clear();
  for (RobotGeom& part : robot_geoms_) dGeomGetAABB(part.geom, part.aabb.data());

  for (std::size_t j = 0; j < objects.size(); ++j) {
    ObjectBody& object = *objects[j];
    // the robot against the object
    bool by_robot = false;
    if (object.description().touches_robot) {
      const Side side{{OwnerKind::kObject, j}, &object.description().surface, object.body(), -1};
      for (dGeomID geom : object.geoms()) {
        dReal box[6];
        dGeomGetAABB(geom, box);
        for (std::size_t r = 0; r < robot_geoms_.size(); ++r) {
          const RobotGeom& part = robot_geoms_[r];
          if (!overlap(part.aabb.data(), box)) continue;
          const Side robot{
              {OwnerKind::kLink, part.link}, &part.surface, robot_.bodies()[part.link], static_cast<int>(r)};
          if (!collide_robot(part, robot, geom, side)) continue;
          by_robot = true;
          // a limb at rest wakes when something touches it, or it would feel no force
          if (robot.body != nullptr) dBodyEnable(robot.body);
        }
      }
    }
    if (by_robot) {
      object.wake();
    } else {
      object.rest_if_quiet(step_s);
    }
  }
  collide_self();
  if (robot_.is_free()) collide_floor();
  // objects against each other: a thing that moves wakes the thing that it meets
  for (std::size_t j = 0; j < objects.size(); ++j) {
    for (std::size_t k = j + 1; k < objects.size(); ++k) {
      if (objects[j]->body() == nullptr || objects[k]->body() == nullptr) continue;
      if (!awake(*objects[j]) && !awake(*objects[k])) continue;
      if (are_joined(joints, j, k)) continue;
      if (!collide_objects(*objects[j], j, *objects[k], k)) continue;
      // what hardly moves lets its neighbour sleep, or stacks would keep each other awake
      if (!awake(*objects[j]) && !objects[k]->hardly_moves()) dBodyEnable(objects[j]->body());
      if (!awake(*objects[k]) && !objects[j]->hardly_moves()) dBodyEnable(objects[k]->body());
    }
  }
  // what is awake against what never moves
  for (std::size_t j = 0; j < objects.size(); ++j) {
    if (!awake(*objects[j])) continue;
    for (std::size_t k = 0; k < objects.size(); ++k) {
      if (objects[k]->body() == nullptr && !are_joined(joints, j, k))
        collide_objects(*objects[j], j, *objects[k], k);
    }
    const Side side{{OwnerKind::kObject, j}, &objects[j]->description().surface, objects[j]->body(), -1};
    const Side floor{{OwnerKind::kFloor, 0}, &kFloorSurface, nullptr, -1};
    for (dGeomID geom : objects[j]->geoms()) {
      dReal box[6];
      dGeomGetAABB(geom, box);
      if (box[4] <= Simulation::kFloorHeight_m) collide(geom, floor_, side, floor, touching_.size(), 0);
    }
  }
}

void Contacts::begin_self_collision() {
  const RobotTree& tree = robot_.tree();
  // hinges between two links
  const auto apart = [&tree](std::size_t a, std::size_t b) {
    const auto path_a = tree.path(a);
    const auto path_b = tree.path(b);
    std::size_t shared = 0;
    while (shared < path_a.size() && shared < path_b.size() && path_a[shared] == path_b[shared]) ++shared;
    return path_a.size() + path_b.size() - 2 * shared;
  };
  self_pairs_.clear();
  for (std::size_t r = 0; r < robot_geoms_.size(); ++r) {
    for (std::size_t s = r + 1; s < robot_geoms_.size(); ++s) {
      const RobotGeom& a = robot_geoms_[r];
      const RobotGeom& b = robot_geoms_[s];
      if (a.link == b.link || apart(a.link, b.link) <= 2) continue;
      if (a.hand >= 0 && a.hand == b.hand) continue;
      dContactGeom found;
      if (dCollide(a.geom, b.geom, 1, &found, sizeof found) > 0) continue;
      self_pairs_.emplace_back(static_cast<int>(r), static_cast<int>(s));
    }
  }
}

void Contacts::collide_self() {
  for (const auto& [r, s] : near_pairs_) {
    const RobotGeom* a = &robot_geoms_[r];
    const RobotGeom* b = &robot_geoms_[s];
    if (!overlap(a->aabb.data(), b->aabb.data())) continue;
    int first = r;
    int second = s;
    // side a moves, and is the capsule if there is one
    if (a->link == 0 || (a->spheres[0] == nullptr && b->spheres[0] != nullptr && b->link != 0)) {
      std::swap(a, b);
      std::swap(first, second);
    }
    const Side side_a{{OwnerKind::kLink, a->link}, &a->surface, robot_.bodies()[a->link], first};
    const Side side_b{{OwnerKind::kLink, b->link}, &b->surface, robot_.bodies()[b->link], second};
    const bool awake_a = robot_.awake(robot_.tree().limb_of(a->link));
    const bool awake_b = b->link != 0 && robot_.awake(robot_.tree().limb_of(b->link));
    if (!awake_a && !awake_b) continue;
    if (!collide_robot(*a, side_a, b->geom, side_b)) continue;
    if (side_a.body != nullptr) dBodyEnable(side_a.body);
    if (side_b.body != nullptr) dBodyEnable(side_b.body);
  }
}

double Contacts::lowest_m() const {
  double lowest = std::numeric_limits<double>::infinity();
  for (const RobotGeom& part : robot_geoms_) {
    dReal box[6];
    dGeomGetAABB(part.geom, box);
    lowest = std::min(lowest, box[4]);
  }
  return lowest;
}

void Contacts::collide_floor() {
  const Side floor{{OwnerKind::kFloor, 0}, &kFloorSurface, nullptr, -1};
  for (std::size_t r = 0; r < robot_geoms_.size(); ++r) {
    const RobotGeom& part = robot_geoms_[r];
    if (part.aabb[4] > Simulation::kFloorHeight_m) continue;
    const Side robot{
        {OwnerKind::kLink, part.link}, &part.surface, robot_.bodies()[part.link], static_cast<int>(r)};
    collide(part.geom, floor_, robot, floor, touching_.size(), 0);
  }
}

void Contacts::begin_period() {
  near_pairs_.clear();
  if (!self_pairs_.empty()) {
    // boxes that hold what a shape may reach within the period
    std::vector<std::array<dReal, 6>> reach(robot_geoms_.size());
    for (std::size_t i = 0; i < robot_geoms_.size(); ++i) {
      dGeomGetAABB(robot_geoms_[i].geom, reach[i].data());
      dBodyID body = robot_.bodies()[robot_geoms_[i].link];
      double margin_m = kSelfMargin_m;
      if (body != nullptr) {
        const double size_m =
            std::max({reach[i][1] - reach[i][0], reach[i][3] - reach[i][2], reach[i][5] - reach[i][4]});
        margin_m +=
            2 * Simulation::kControlPeriod_s *
            (to_eigen(dBodyGetLinearVel(body)).norm() + size_m * to_eigen(dBodyGetAngularVel(body)).norm());
      }
      for (int k = 0; k < 6; ++k) reach[i][k] += k % 2 == 0 ? -margin_m : margin_m;
    }
    for (const auto& pair : self_pairs_) {
      if (overlap(reach[pair.first].data(), reach[pair.second].data())) near_pairs_.push_back(pair);
    }
  }
  sum_ = {};
  skin_.begin_period();
  steps_ = 0;
}

void Contacts::read_forces() {
  for (std::size_t i = 0; i < touching_.size(); ++i) {
    Touching& t = touching_[i];
    t.force_N = solved_[i].normal_force_N;
    // the pads feel the world, not the robot's own hand
    if (t.robot_geom < 0 || t.robot_geom_b >= 0) continue;
    const RobotGeom& part = robot_geoms_[t.robot_geom];
    if (part.patch >= 0) {
      const auto patch = static_cast<std::size_t>(part.patch);
      const Eigen::Isometry3d X_PatchWorld = X_PatchLink_[patch] * robot_.X_WorldLink(part.link).inverse();
      skin_.press(patch, X_PatchWorld * t.p_World_m, t.force_N);
    }
    if (!part.pad) continue;
    sum_[part.hand].on[part.finger] = true;
    sum_[part.hand].force_N[part.finger] += t.force_N;
  }
  ++steps_;
}

void Contacts::end_period() {
  skin_.end_period(std::max(steps_, 1));
  for (std::size_t hand = 0; hand < touch_.size(); ++hand) {
    for (std::size_t pad = 0; pad < kPadCount; ++pad) {
      const SkinFault fault = skin_fault_[hand][pad];
      if (fault == SkinFault::kStuck) continue;
      const bool feels = fault != SkinFault::kOff;
      touch_[hand].on[pad] = feels && sum_[hand].on[pad];
      touch_[hand].force_N[pad] = feels ? sum_[hand].force_N[pad] / std::max(steps_, 1) : 0;
    }
  }
}

void Contacts::force_on_link(std::size_t link, const Eigen::Vector3d& p_World_m, Eigen::Vector3d& force_N,
                             Eigen::Vector3d& torque_Nm) const {
  const int index = static_cast<int>(link);
  for (const ContactSolver::Contact& contact : solved_) {
    if (index == 0 || (contact.a.link != index && contact.b.link != index)) continue;
    const double sign = contact.a.link == index ? 1 : -1;
    force_N += sign * contact.force_World_N;
    torque_Nm +=
        sign * (contact.torque_World_Nm + (contact.p_World_m - p_World_m).cross(contact.force_World_N));
  }
}

void Contacts::restore(const State& state) {
  touch_ = state.touch;
  skin_fault_ = state.skin_fault;
  skin_.restore(state.skin);
  forget();
  grips_ = state.grips;
  former_loads_ = state.loads;
  loads_restored_ = true;
  touching_ = state.touching;
}

Contacts::State Contacts::save() const {
  return {touch_, skin_fault_, skin_.save(), grips_, loads(), touching_};
}

void Contacts::restart() {
  touch_ = {};
  skin_fault_ = {};
  skin_.clear();
  forget();
}

void Contacts::forget() {
  touching_.clear();
  solved_.clear();
  grips_.clear();
  former_loads_.clear();
  loads_restored_ = false;
}

std::string Contacts::name_of(const Owner& owner, int robot_geom, const Objects& objects) const {
  if (owner.kind == OwnerKind::kFloor) return "floor";
  if (owner.kind == OwnerKind::kLink) return robot_geoms_[robot_geom].name;
  return objects[owner.index]->description().name;
}

std::vector<ContactPair> Contacts::pairs(const Objects& objects) const {
  std::map<std::pair<std::string, std::string>, std::pair<ContactPair, int>> sums;
  for (const Touching& t : touching_) {
    const std::string a = name_of(t.a, t.robot_geom, objects);
    const std::string b = name_of(t.b, t.robot_geom_b, objects);
    auto& [pair, count] = sums[{a, b}];
    pair.a = a;
    pair.b = b;
    pair.a_is_robot = t.a.kind == OwnerKind::kLink;
    pair.b_is_robot = t.b.kind == OwnerKind::kLink;
    pair.force_N += t.force_N;
    pair.p_World_m += t.p_World_m;
    pair.depth_m = std::max(pair.depth_m, t.depth_m);
    ++count;
  }
  std::vector<ContactPair> result;
  for (auto& [key, value] : sums) {
    value.first.p_World_m /= value.second;
    result.push_back(value.first);
  }
  return result;
}

HoldQuery Contacts::hold(std::size_t object, const Objects& objects) const {
  HoldQuery query;
  for (const Touching& t : touching_) {
    const bool is_a = t.a.kind == OwnerKind::kObject && t.a.index == object;
    const bool is_b = t.b.kind == OwnerKind::kObject && t.b.index == object;
    if (!is_a && !is_b) continue;
    if (t.a.kind != OwnerKind::kLink) {
      query.world = true;
      continue;
    }
    const RobotGeom& part = robot_geoms_[t.robot_geom];
    if (part.hand < 0) {
      query.other_robot_link = true;
    } else {
      (part.hand == 0 ? query.left : query.right)[part.finger] = true;
    }
  }
  // a sleeping thing lies on something
  if (objects[object]->body() != nullptr && dBodyIsEnabled(objects[object]->body()) == 0) query.world = true;
  return query;
}

}  // namespace nido::sim
