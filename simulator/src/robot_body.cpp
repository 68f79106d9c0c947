#include "robot_body.h"

#include <algorithm>

#include "ode_library.h"

namespace nido::sim {
namespace {

constexpr double kGravity_m_s2 = 9.81;

// A motor with its gear adds inertia about the hinge that a list of link masses does not show. ODE has no
// place for it but the link's own inertia. Without it, finger segments of a few grams would make the solver
// stiff.
constexpr double kRotorInertia_kgm2 = 2e-5;
constexpr double kLeastMass_kg = 0.02;
constexpr double kStopMargin_rad = 0.008;

}  // namespace

RobotBody::RobotBody(dWorldID world, RobotDescription description) : description_(std::move(description)) {
  const std::size_t count = description_.links.size();
  bodies_.assign(count, nullptr);
  hinges_.assign(count, nullptr);
  feedback_.assign(count, dJointFeedback{});

  // bodies at angle zero; the body's frame is the link's, moved to the centre of mass
  std::vector<Eigen::Isometry3d> X_WorldLink(count, Eigen::Isometry3d::Identity());
  for (std::size_t i = 1; i < count; ++i) {
    const LinkDescription& link = description_.links[i];
    X_WorldLink[i] = X_WorldLink[static_cast<std::size_t>(link.parent)] * link.X_ParentLink;
    dBodyID body = dBodyCreate(world);
    bodies_[i] = body;
    Eigen::Isometry3d X_WorldBody = X_WorldLink[i];
    X_WorldBody.translation() = X_WorldLink[i] * link.mass.center_m;
    set_body_pose(body, X_WorldBody);

    const double mass_kg = std::max(link.mass.mass_kg, kLeastMass_kg);
    const Eigen::Matrix3d I = link.mass.inertia_kgm2 * (mass_kg / link.mass.mass_kg) +
                              kRotorInertia_kgm2 * Eigen::Matrix3d::Identity();
    dMass mass;
    dMassSetParameters(&mass, mass_kg, 0, 0, 0, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
    dBodySetMass(body, &mass);
    dBodySetGravityMode(body, 0);
    dBodySetAutoDisableFlag(body, 0);
    dBodySetGyroscopicMode(body, 0);

    dJointID hinge = dJointCreateHinge(world, nullptr);
    hinges_[i] = hinge;
    dJointAttach(hinge, body, bodies_[static_cast<std::size_t>(link.parent)]);
    const Eigen::Vector3d p = X_WorldLink[i].translation();
    const Eigen::Vector3d a = X_WorldLink[i].linear() * link.axis_Link;
    dJointSetHingeAnchor(hinge, p.x(), p.y(), p.z());
    dJointSetHingeAxis(hinge, a.x(), a.y(), a.z());
    // the stops lie just beyond the limits that the drives keep: a motor that works at a stop chatters in ODE
    dJointSetHingeParam(hinge, dParamLoStop, link.min_rad - kStopMargin_rad);
    dJointSetHingeParam(hinge, dParamHiStop, link.max_rad + kStopMargin_rad);
    dJointSetHingeParam(hinge, dParamStopERP, 0.4);
    dJointSetHingeParam(hinge, dParamStopCFM, 1e-6);
    dJointSetFeedback(hinge, &feedback_[i]);
  }
}

RobotBody::~RobotBody() {
  for (dJointID hinge : hinges_) {
    if (hinge != nullptr) dJointDestroy(hinge);
  }
  for (dBodyID body : bodies_) {
    if (body != nullptr) dBodyDestroy(body);
  }
}

Eigen::Isometry3d RobotBody::X_WorldLink(std::size_t link) const {
  if (link == 0) return Eigen::Isometry3d::Identity();
  Eigen::Isometry3d X = body_pose(bodies_[link]);
  X.translation() -= X.linear() * description_.links[link].mass.center_m;
  return X;
}

void RobotBody::place(const std::vector<double>& angle_rad) {
  std::vector<Eigen::Isometry3d> X_WorldLink(description_.links.size(), Eigen::Isometry3d::Identity());
  for (std::size_t i = 1; i < description_.links.size(); ++i) {
    const LinkDescription& link = description_.links[i];
    X_WorldLink[i] = X_WorldLink[static_cast<std::size_t>(link.parent)] * link.X_ParentLink *
                     Eigen::AngleAxisd(angle_rad[i], link.axis_Link);
    Eigen::Isometry3d X_WorldBody = X_WorldLink[i];
    X_WorldBody.translation() = X_WorldLink[i] * link.mass.center_m;
    set_body_pose(bodies_[i], X_WorldBody);
  }
}

void RobotBody::gravity_torques(std::vector<double>& torque_Nm) const {
  const std::size_t count = description_.links.size();
  torque_Nm.assign(count, 0);
  // mass and first moment of everything beyond a hinge, gathered from the tips
  std::vector<double> mass(count, 0);
  std::vector<Eigen::Vector3d> moment(count, Eigen::Vector3d::Zero());
  for (std::size_t i = count - 1; i > 0; --i) {
    const LinkDescription& link = description_.links[i];
    const Eigen::Vector3d center = to_eigen(dBodyGetPosition(bodies_[i]));
    mass[i] += link.mass.mass_kg;
    moment[i] += link.mass.mass_kg * center;
    dVector3 anchor;
    dVector3 axis;
    dJointGetHingeAnchor(hinges_[i], anchor);
    dJointGetHingeAxis(hinges_[i], axis);
    const Eigen::Vector3d arm = moment[i] - mass[i] * to_eigen(anchor);
    torque_Nm[i] = to_eigen(axis).dot(arm.cross(Eigen::Vector3d(0, 0, -kGravity_m_s2)));
    mass[static_cast<std::size_t>(link.parent)] += mass[i];
    moment[static_cast<std::size_t>(link.parent)] += moment[i];
  }
}

double RobotBody::constraint_torque_Nm(std::size_t link) const {
  dVector3 anchor;
  dVector3 axis;
  dJointGetHingeAnchor(hinges_[link], anchor);
  dJointGetHingeAxis(hinges_[link], axis);
  const dJointFeedback& f = feedback_[link];
  const Eigen::Vector3d lever = to_eigen(dBodyGetPosition(bodies_[link])) - to_eigen(anchor);
  return to_eigen(axis).dot(to_eigen(f.t1) + lever.cross(to_eigen(f.f1)));
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
