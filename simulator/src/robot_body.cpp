#include "robot_body.h"

#include <algorithm>

#include "ode_library.h"

namespace nido::sim {
namespace {

constexpr double kGravity_m_s2 = 9.81;

}  // namespace

RobotBody::RobotBody(dWorldID world, RobotDescription description)
    : description_(std::move(description)), tree_(description_) {
  bodies_.assign(link_count(), nullptr);
  for (std::size_t i = 1; i < link_count(); ++i) {
    bodies_[i] = dBodyCreate(world);
    dBodySetGravityMode(bodies_[i], 0);
    dBodySetAutoDisableFlag(bodies_[i], 0);
  }
  for (std::size_t limb = 0; limb < tree_.limb_count(); ++limb) show(limb);
}

RobotBody::~RobotBody() {
  for (dBodyID body : bodies_) {
    if (body != nullptr) dBodyDestroy(body);
  }
}

Eigen::Isometry3d RobotBody::X_WorldLink(std::size_t link) const {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  if (link == 0) return X;
  X.linear() = tree_.R_WorldLink(link);
  X.translation() = tree_.p_WorldLink_m(link);
  return X;
}

void RobotBody::show(std::size_t limb) {
  const auto [first, end] = tree_.limb(limb);
  for (std::size_t i = first; i < end; ++i) {
    dBodyID body = bodies_[i];
    // straight into the body: ODE's setter would normalise again and build the matrix a second time
    const Eigen::Quaterniond& orientation = tree_.q_WorldLink(i);
    dReal* q = const_cast<dReal*>(dBodyGetQuaternion(body));
    to_ode(orientation, q);
    dReal* R = const_cast<dReal*>(dBodyGetRotation(body));
    const Eigen::Matrix3d& matrix = tree_.R_WorldLink(i);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) R[4 * row + column] = matrix(row, column);
    }
    const Eigen::Vector3d& p = tree_.p_WorldCom_m(i);
    dBodySetPosition(body, p.x(), p.y(), p.z());  // the geoms learn that they moved
    const Eigen::Vector3d v = tree_.v_WorldCom_m_s(i);
    const Eigen::Vector3d& w = tree_.w_World_rad_s(i);
    dBodySetLinearVel(body, v.x(), v.y(), v.z());
    dBodySetAngularVel(body, w.x(), w.y(), w.z());
  }
}

void RobotBody::place(const std::vector<double>& angle_rad) {
  for (std::size_t i = 1; i < link_count(); ++i)
    tree_.set(i, floats(i) ? tree_.angle_rad(i) : angle_rad[i], 0);
  for (std::size_t limb = 0; limb < tree_.limb_count(); ++limb) {
    tree_.rest(limb);
    show(limb);
  }
}

void RobotBody::put_base_back() {
  if (!is_free()) return;
  for (std::size_t i = 1; i <= kBaseDegrees; ++i) tree_.set(i, 0, 0);
  tree_.set(3, base_height_m_, 0);
  tree_.update(0);
  show(0);
}

void RobotBody::gravity_torques(std::vector<double>& torque_Nm) const {
  const std::size_t count = description_.links.size();
  torque_Nm.assign(count, 0);
  // mass and first moment of everything beyond a hinge, gathered from the tips
  std::vector<double> mass(count, 0);
  std::vector<Eigen::Vector3d> moment(count, Eigen::Vector3d::Zero());
  for (std::size_t i = count - 1; i > 0; --i) {
    const LinkDescription& link = description_.links[i];
    mass[i] += link.mass.mass_kg;
    moment[i] += link.mass.mass_kg * tree_.p_WorldCom_m(i);
    const Eigen::Vector3d gravity_m_s2(0, 0, -kGravity_m_s2);
    if (link.freedom == Freedom::kBaseSlide) {
      torque_Nm[i] = mass[i] * tree_.move_along(i, Eigen::Vector3d::Zero(), gravity_m_s2);
    } else {
      const Eigen::Vector3d arm = moment[i] - mass[i] * tree_.p_WorldLink_m(i);
      torque_Nm[i] = tree_.axis_World(i).dot(arm.cross(gravity_m_s2));
    }
    mass[static_cast<std::size_t>(link.parent)] += mass[i];
    moment[static_cast<std::size_t>(link.parent)] += moment[i];
  }
}

bool RobotBody::awake(std::size_t limb) const {
  const auto [first, end] = tree_.limb(limb);
  return std::any_of(bodies_.begin() + static_cast<std::ptrdiff_t>(first),
                     bodies_.begin() + static_cast<std::ptrdiff_t>(end),
                     [](dBodyID body) { return dBodyIsEnabled(body) != 0; });
}

void RobotBody::rest(std::size_t limb) {
  if (!awake(limb)) return;
  tree_.rest(limb);
  show(limb);
  const auto [first, end] = tree_.limb(limb);
  for (std::size_t i = first; i < end; ++i) dBodyDisable(bodies_[i]);
}

RobotBody::State RobotBody::save() const {
  State state{tree_.save(), {}};
  for (dBodyID body : bodies_) state.awake.push_back(body != nullptr && dBodyIsEnabled(body) != 0);
  return state;
}

void RobotBody::restore(const State& state) {
  tree_.restore(state.tree);
  for (std::size_t limb = 0; limb < tree_.limb_count(); ++limb) show(limb);
  for (std::size_t i = 1; i < link_count(); ++i) {
    if (state.awake[i]) {
      dBodyEnable(bodies_[i]);
    } else {
      dBodyDisable(bodies_[i]);
    }
  }
}

RobotBody::Frame RobotBody::find_frame(std::string_view name) const {
  for (std::size_t i = 0; i < description_.links.size(); ++i) {
    for (const NamedFrame& frame : description_.links[i].frames) {
      if (frame.name == name) return {static_cast<int>(i), frame.X_LinkFrame};
    }
  }
  return {};
}

}  // namespace nido::sim
