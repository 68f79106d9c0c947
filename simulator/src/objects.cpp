#include "objects.h"

#include <algorithm>
#include <cmath>

#include "ode_library.h"

namespace nido::sim {
namespace {

constexpr double kQuietSpeed_m_s = 0.006;
constexpr double kQuietTurn_rad_s = 0.15;
constexpr double kStillSpeed_m_s = 0.001;
constexpr double kStillTurn_rad_s = 0.03;
constexpr double kQuietTime_s = 0.2;

}  // namespace

double mass_kg(const ObjectDescription& description) {
  double sum = 0;
  for (const PlacedShape& shape : description.shapes) sum += shape.mass_kg;
  return sum;
}

Eigen::AlignedBox3d bounds(const ObjectDescription& description) {
  Eigen::AlignedBox3d box;
  for (const PlacedShape& shape : description.shapes) extend_bounds(shape, box);
  return box;
}

void set_mass(ObjectDescription& description, double mass) {
  const double now = mass_kg(description);
  for (PlacedShape& shape : description.shapes) {
    shape.mass_kg =
        now > 0 ? shape.mass_kg * mass / now : mass / static_cast<double>(description.shapes.size());
  }
}

ObjectBody::ObjectBody(dWorldID world, ObjectDescription description) : description_(std::move(description)) {
  for (const PlacedShape& shape : description_.shapes) {
    dGeomID geom = make_geom(shape, mesh_data_);
    if (geom != nullptr) geoms_.push_back(geom);
  }
  if (!description_.is_static) {
    body_ = dBodyCreate(world);
    dBodySetAutoDisableFlag(body_, 0);
    dBodySetLinearDamping(body_, 0.0);
    apply_mass();
  }
  place(description_.X_WorldObject);
}

ObjectBody::~ObjectBody() {
  for (dGeomID geom : geoms_) dGeomDestroy(geom);
  for (dTriMeshDataID data : mesh_data_) dGeomTriMeshDataDestroy(data);
  if (body_ != nullptr) dBodyDestroy(body_);
}

void ObjectBody::apply_mass() {
  std::vector<MassProperties> parts;
  for (const PlacedShape& shape : description_.shapes) parts.push_back(mass_of(shape));
  const MassProperties sum = combine(parts);
  p_ObjectCom_m_ = sum.center_m;
  const Eigen::Matrix3d& I = sum.inertia_kgm2;
  dMass mass;
  dMassSetParameters(&mass, sum.mass_kg, 0, 0, 0, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
  dBodySetMass(body_, &mass);
  // the body's frame is at the centre of mass
  for (std::size_t i = 0; i < geoms_.size(); ++i) {
    Eigen::Isometry3d X_BodyShape = description_.shapes[i].X_OwnerShape;
    X_BodyShape.translation() -= p_ObjectCom_m_;
    place_geom(geoms_[i], body_, X_BodyShape);
  }
}

void ObjectBody::set_mass_kg(double mass) {
  set_mass(description_, mass);
  if (body_ != nullptr) apply_mass();
}

void ObjectBody::set_velocity(const Eigen::Vector3d& v, const Eigen::Vector3d& w) {
  if (body_ == nullptr) return;
  dBodySetLinearVel(body_, v.x(), v.y(), v.z());
  dBodySetAngularVel(body_, w.x(), w.y(), w.z());
  wake();
}

Eigen::Vector3d ObjectBody::point_of_body(const Eigen::Vector3d& p_World_m) const {
  return body_ == nullptr ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : body_pose(body_).inverse() * p_World_m;
}

void ObjectBody::push(const Push& push) {
  push_ = push;
  wake();
}

void ObjectBody::apply_push(double step_s) {
  // half a step of grace: times are sums of steps
  if (body_ == nullptr || push_.left_s < step_s / 2) return;
  wake();
  const Eigen::Vector3d& f = push_.force_World_N;
  const Eigen::Vector3d t =
      push_.torque_World_Nm + (body_pose(body_).linear() * push_.p_ComPoint_Body_m).cross(f);
  dBodyAddForce(body_, f.x(), f.y(), f.z());
  dBodyAddTorque(body_, t.x(), t.y(), t.z());
  push_.left_s -= step_s;
}

Eigen::Isometry3d ObjectBody::X_WorldObject() const {
  if (body_ == nullptr) return X_WorldStatic_;
  Eigen::Isometry3d X = body_pose(body_);
  X.translation() -= X.linear() * p_ObjectCom_m_;
  return X;
}

void ObjectBody::place(const Eigen::Isometry3d& X_WorldObject) {
  if (body_ == nullptr) {
    X_WorldStatic_ = X_WorldObject;
    for (std::size_t i = 0; i < geoms_.size(); ++i) {
      place_geom(geoms_[i], nullptr, X_WorldObject * description_.shapes[i].X_OwnerShape);
    }
    return;
  }
  Eigen::Isometry3d X_WorldBody = X_WorldObject;
  X_WorldBody.translation() = X_WorldObject * p_ObjectCom_m_;
  set_body_pose(body_, X_WorldBody);
  wake();
}

void ObjectBody::set_colour(const std::array<float, 3>& rgb) {
  for (PlacedShape& shape : description_.shapes) {
    std::copy(rgb.begin(), rgb.end(), shape.shape.rgba.begin());
    shape.shape.texture.clear();
  }
}

ObjectState ObjectBody::state() const {
  ObjectState state;
  state.name = description_.name;
  state.kind = description_.kind;
  state.is_static = description_.is_static;
  state.mass_kg = description_.is_static ? 0 : mass_kg(description_);
  state.size_m = bounds(description_).sizes();
  state.X_WorldObject = X_WorldObject();
  if (body_ != nullptr) {
    state.v_World_m_s = to_eigen(dBodyGetLinearVel(body_));
    state.w_World_rad_s = to_eigen(dBodyGetAngularVel(body_));
  }
  return state;
}

void ObjectBody::rest_if_quiet(double step_s) {
  if (body_ == nullptr || dBodyIsEnabled(body_) == 0) return;
  const bool quiet = to_eigen(dBodyGetLinearVel(body_)).norm() < kQuietSpeed_m_s &&
                     to_eigen(dBodyGetAngularVel(body_)).norm() < kQuietTurn_rad_s;
  quiet_s_ = quiet ? quiet_s_ + step_s : 0;
  if (quiet_s_ > kQuietTime_s) {
    dBodySetLinearVel(body_, 0, 0, 0);
    dBodySetAngularVel(body_, 0, 0, 0);
    dBodyDisable(body_);
    quiet_s_ = 0;
  }
}

bool ObjectBody::hardly_moves() const {
  return body_ == nullptr || (to_eigen(dBodyGetLinearVel(body_)).norm() < kStillSpeed_m_s &&
                              to_eigen(dBodyGetAngularVel(body_)).norm() < kStillTurn_rad_s);
}

void ObjectBody::wake() {
  quiet_s_ = 0;
  if (body_ != nullptr) dBodyEnable(body_);
}

ObjectBody::Motion read_motion(dBodyID body) {
  ObjectBody::Motion m;
  std::copy_n(dBodyGetPosition(body), 3, m.position.begin());
  std::copy_n(dBodyGetQuaternion(body), 4, m.quaternion.begin());
  std::copy_n(dBodyGetRotation(body), 12, m.rotation.begin());
  std::copy_n(dBodyGetLinearVel(body), 3, m.velocity.begin());
  std::copy_n(dBodyGetAngularVel(body), 3, m.angular_velocity.begin());
  m.enabled = dBodyIsEnabled(body) != 0;
  return m;
}

void write_motion(dBodyID body, const ObjectBody::Motion& m) {
  // the setters tell the geoms that they moved; the copies after them undo their rounding
  dBodySetPosition(body, m.position[0], m.position[1], m.position[2]);
  dBodySetQuaternion(body, m.quaternion.data());
  std::copy_n(m.quaternion.begin(), 4, const_cast<dReal*>(dBodyGetQuaternion(body)));
  std::copy_n(m.rotation.begin(), 12, const_cast<dReal*>(dBodyGetRotation(body)));
  dBodySetLinearVel(body, m.velocity[0], m.velocity[1], m.velocity[2]);
  dBodySetAngularVel(body, m.angular_velocity[0], m.angular_velocity[1], m.angular_velocity[2]);
  dBodySetForce(body, 0, 0, 0);
  dBodySetTorque(body, 0, 0, 0);
  if (m.enabled) {
    dBodyEnable(body);
  } else {
    dBodyDisable(body);
  }
}

ObjectBody::Motion ObjectBody::motion() const {
  Motion m;
  if (body_ != nullptr) m = read_motion(body_);
  m.X_WorldObject = X_WorldObject();
  m.quiet_s = quiet_s_;
  m.push = push_;
  return m;
}

void ObjectBody::set_motion(const Motion& m) {
  if (body_ == nullptr) {
    place(m.X_WorldObject);
    return;
  }
  write_motion(body_, m);
  quiet_s_ = m.quiet_s;
  push_ = m.push;
}

}  // namespace nido::sim
