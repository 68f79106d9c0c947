#include <ode/ode.h>

#include "ode_library.h"
#include "physics_scene.h"
#include "robot_body.h"
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
    robot_ = std::make_unique<sim::RobotBody>(world_.id(), std::move(description));
    const auto& links = robot_->description().links;
    for (std::size_t i = 1; i < links.size(); ++i) {
      dBodySetGravityMode(robot_->bodies()[i], 1);
      hinge_of_link_.push_back(scene.model().hinge_index(links[i].joint_name).value());
    }
    for (std::size_t i = 0; i < links.size(); ++i) {
      for (const sim::LinkShape& shape : links[i].collisions) {
        Eigen::Isometry3d X = shape.placed.X_OwnerShape;
        if (i != 0) X.translation() -= links[i].mass.center_m;
        dGeomID geom = sim::make_geom(shape.placed, meshes_);
        if (geom == nullptr) continue;
        sim::place_geom(geom, robot_->bodies()[i], X);
        dSpaceAdd(space_, geom);
        dGeomSetCategoryBits(geom, 1);
        dGeomSetCollideBits(geom, 2);
      }
    }
    std::vector<double> angles(links.size(), 0);
    const Eigen::VectorXd hinges = scene.model().hinge_angles(scene.start_rad());
    for (std::size_t i = 1; i < links.size(); ++i) angles[i] = hinges[hinge_of_link_[i - 1]];
    robot_->place(angles);
    add(scene.table(), false);
    for (const Thing& thing : scene.things()) add(thing, true);
  }

  ~BareOde() override {
    dJointGroupDestroy(contacts_);
    dSpaceDestroy(space_);
    for (dBodyID body : bodies_) dBodyDestroy(body);
    for (dTriMeshDataID data : meshes_) dGeomTriMeshDataDestroy(data);
    robot_.reset();
  }

  [[nodiscard]] std::string name() const override { return "bare ODE"; }

  Status advance(const Eigen::VectorXd& axes_rad) override {
    const Eigen::VectorXd hinges = scene_.model().hinge_angles(axes_rad);
    const auto& links = robot_->description().links;
    for (int step = 0; step < 10; ++step) {
      for (std::size_t i = 1; i < links.size(); ++i) {
        const double error = hinges[hinge_of_link_[i - 1]] - robot_->angle_rad(i);
        dJointSetHingeParam(robot_->hinges()[i], dParamVel, 50 * error);
        dJointSetHingeParam(robot_->hinges()[i], dParamFMax, links[i].max_torque_Nm);
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
  std::unique_ptr<sim::RobotBody> robot_;
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
