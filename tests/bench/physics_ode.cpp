#include <ode/ode.h>

#include "ode_library.h"
#include "physics_scene.h"
#include "robot_description.h"
#include "simulation_impl.h"

namespace nido::bench {
namespace {

class BareOde : public Contender {
 public:
  BareOde(const PhysicsScene& scene, sim::RobotDescription description)
      : scene_(scene), space_(dHashSpaceCreate(nullptr)), contacts_(dJointGroupCreate(0)) {
    dWorldSetGravity(world_.id(), 0, 0, -9.81);
    dWorldSetERP(world_.id(), 0.4);
    dWorldSetCFM(world_.id(), 1e-7);
    dWorldSetQuickStepNumIterations(world_.id(), 20);
    links_ = std::move(description.links);
    const auto& links = links_;
    body_.assign(links.size(), nullptr);
    hinge_.assign(links.size(), nullptr);
    std::vector<Eigen::Isometry3d> X_WorldLink(links.size(), Eigen::Isometry3d::Identity());
    for (std::size_t i = 1; i < links.size(); ++i) {
      const sim::LinkDescription& link = links[i];
      hinge_of_link_.push_back(scene.model().hinge_index(link.joint_name).value());
      X_WorldLink[i] = X_WorldLink[static_cast<std::size_t>(link.parent)] * link.X_ParentLink;
      body_[i] = dBodyCreate(world_.id());
      Eigen::Isometry3d X_WorldBody = X_WorldLink[i];
      X_WorldBody.translation() = X_WorldLink[i] * link.mass.center_m;
      sim::set_body_pose(body_[i], X_WorldBody);
      const double mass_kg = std::max(link.mass.mass_kg, 0.02);
      const Eigen::Matrix3d I =
          link.mass.inertia_kgm2 * (mass_kg / link.mass.mass_kg) + 2e-5 * Eigen::Matrix3d::Identity();
      dMass mass;
      dMassSetParameters(&mass, mass_kg, 0, 0, 0, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
      dBodySetMass(body_[i], &mass);
      hinge_[i] = dJointCreateHinge(world_.id(), nullptr);
      dJointAttach(hinge_[i], body_[i], body_[static_cast<std::size_t>(link.parent)]);
      const Eigen::Vector3d p = X_WorldLink[i].translation();
      const Eigen::Vector3d a = X_WorldLink[i].linear() * link.axis_Link;
      dJointSetHingeAnchor(hinge_[i], p.x(), p.y(), p.z());
      dJointSetHingeAxis(hinge_[i], a.x(), a.y(), a.z());
      dJointSetHingeParam(hinge_[i], dParamLoStop, link.min_rad - 0.008);
      dJointSetHingeParam(hinge_[i], dParamHiStop, link.max_rad + 0.008);
    }
    for (std::size_t i = 0; i < links.size(); ++i) {
      for (const sim::LinkShape& shape : links[i].collisions) {
        Eigen::Isometry3d X = shape.placed.X_OwnerShape;
        if (i != 0) X.translation() -= links[i].mass.center_m;
        dGeomID geom = sim::make_geom(shape.placed, meshes_);
        if (geom == nullptr) continue;
        sim::place_geom(geom, body_[i], X);
        dSpaceAdd(space_, geom);
        dGeomSetCategoryBits(geom, 1);
        dGeomSetCollideBits(geom, 2);
      }
    }
    const Eigen::VectorXd hinges = scene.model().hinge_angles(scene.start_rad());
    for (std::size_t i = 1; i < links.size(); ++i) {
      X_WorldLink[i] = X_WorldLink[static_cast<std::size_t>(links[i].parent)] * links[i].X_ParentLink *
                       Eigen::AngleAxisd(hinges[hinge_of_link_[i - 1]], links[i].axis_Link);
      Eigen::Isometry3d X_WorldBody = X_WorldLink[i];
      X_WorldBody.translation() = X_WorldLink[i] * links[i].mass.center_m;
      sim::set_body_pose(body_[i], X_WorldBody);
    }
    add(scene.table(), false);
    for (const Thing& thing : scene.things()) add(thing, true);
  }

  ~BareOde() override {
    dJointGroupDestroy(contacts_);
    dSpaceDestroy(space_);
    for (dBodyID body : bodies_) dBodyDestroy(body);
    for (dTriMeshDataID data : meshes_) dGeomTriMeshDataDestroy(data);
  }

  [[nodiscard]] std::string name() const override { return "bare ODE"; }

  Status advance(const Eigen::VectorXd& axes_rad) override {
    const Eigen::VectorXd hinges = scene_.model().hinge_angles(axes_rad);
    for (int step = 0; step < 10; ++step) {
      for (std::size_t i = 1; i < links_.size(); ++i) {
        const double error = hinges[hinge_of_link_[i - 1]] - dJointGetHingeAngle(hinge_[i]);
        dJointSetHingeParam(hinge_[i], dParamVel, 50 * error);
        dJointSetHingeParam(hinge_[i], dParamFMax, links_[i].max_torque_Nm);
      }
      dJointGroupEmpty(contacts_);
      count_ = 0;
      dSpaceCollide(space_, this,
                    [](void* self, dGeomID a, dGeomID b) { static_cast<BareOde*>(self)->meet(a, b); });
      dWorldQuickStep(world_.id(), 0.001);
    }
    return {};
  }

  [[nodiscard]] int contacts() const override { return count_; }

 private:
  void add(const Thing& thing, bool moves) {
    const Eigen::Vector3d& s = thing.size_m;
    dGeomID geom = thing.ball ? dCreateSphere(space_, s.x()) : dCreateBox(space_, s.x(), s.y(), s.z());
    dGeomSetCategoryBits(geom, 2);
    dGeomSetCollideBits(geom, 3);
    if (moves) {
      dBodyID body = dBodyCreate(world_.id());
      dMass mass;
      if (thing.ball) {
        dMassSetSphereTotal(&mass, thing.mass_kg, s.x());
      } else {
        dMassSetBoxTotal(&mass, thing.mass_kg, s.x(), s.y(), s.z());
      }
      dBodySetMass(body, &mass);
      dGeomSetBody(geom, body);
      bodies_.push_back(body);
    }
    dGeomSetPosition(geom, thing.p_Root_m.x(), thing.p_Root_m.y(), thing.p_Root_m.z());
  }

  void meet(dGeomID a, dGeomID b) {
    std::array<dContact, 8> contact{};
    const int n = dCollide(a, b, 8, &contact[0].geom, sizeof(dContact));
    for (int i = 0; i < n; ++i) {
      contact[i].surface.mode = dContactApprox1 | dContactSoftERP | dContactSoftCFM;
      contact[i].surface.mu = 1;
      contact[i].surface.soft_erp = 0.2;
      contact[i].surface.soft_cfm = 0.01;
      dJointAttach(dJointCreateContact(world_.id(), contacts_, &contact[i]), dGeomGetBody(a),
                   dGeomGetBody(b));
      ++count_;
    }
  }

  const PhysicsScene& scene_;
  sim::OdeWorld world_;
  dSpaceID space_;
  dJointGroupID contacts_;
  std::vector<sim::LinkDescription> links_;
  std::vector<dBodyID> body_;  // by link
  std::vector<dJointID> hinge_;
  std::vector<int> hinge_of_link_;
  std::vector<dBodyID> bodies_;
  std::vector<dTriMeshDataID> meshes_;
  int count_ = 0;
};

}  // namespace

Result<std::unique_ptr<Contender>> make_bare_ode(const PhysicsScene& scene) {
  sim::prepare_ode();
  auto description = sim::read_robot(scene.urdf_path());
  if (!description) return description.error();
  return std::unique_ptr<Contender>(std::make_unique<BareOde>(scene, std::move(*description)));
}

}  // namespace nido::bench
