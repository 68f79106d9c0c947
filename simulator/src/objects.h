#pragma once

#include <ode/ode.h>

#include <array>
#include <string>
#include <vector>

#include "nido/simulator/simulation.h"
#include "shapes.h"

namespace nido::sim {

// How something touches.
struct Surface {
  double friction = 1.0;      // a pair slides at the geometric mean of both
  double restitution = 0.0;   // a pair bounces with the lower of both
  double rolling_m = 0.0003;  // resistance to rolling: lever arm
};

// What an object is, before it is in the world.
struct ObjectDescription {
  std::string name;
  std::string kind;  // "box", "sph", "cyl", "model", "basket", "bear", "table", ...
  bool is_static = false;
  bool touches_robot = true;  // the world vocabulary's collide flag
  Surface surface;
  std::vector<PlacedShape> shapes;  // in the object's frame, with their masses
  Eigen::Isometry3d X_WorldObject = Eigen::Isometry3d::Identity();  // at the start
};

[[nodiscard]] double mass_kg(const ObjectDescription& description);
// Box around the shapes in the object's frame.
[[nodiscard]] Eigen::AlignedBox3d bounds(const ObjectDescription& description);
// Scales the mass of all shapes so that their sum is this.
void set_mass(ObjectDescription& description, double mass_kg);

// An object in the world.
class ObjectBody {
 public:
  ObjectBody(dWorldID world, ObjectDescription description);
  ~ObjectBody();
  ObjectBody(const ObjectBody&) = delete;
  ObjectBody& operator=(const ObjectBody&) = delete;

  [[nodiscard]] const ObjectDescription& description() const { return description_; }
  [[nodiscard]] dBodyID body() const { return body_; }  // nullptr: static
  [[nodiscard]] const std::vector<dGeomID>& geoms() const { return geoms_; }
  [[nodiscard]] Eigen::Isometry3d X_WorldObject() const;
  [[nodiscard]] ObjectState state() const;

  // At rest there.
  void place(const Eigen::Isometry3d& X_WorldObject);
  void set_colour(const std::array<float, 3>& rgb);
  void set_surface(const Surface& surface) { description_.surface = surface; }
  void set_name(const std::string& name) { description_.name = name; }
  void set_mass_kg(double mass_kg);
  // Of the centre of mass; nothing for static objects.
  void set_velocity(const Eigen::Vector3d& v_World_m_s, const Eigen::Vector3d& w_World_rad_s);
  struct Push {
    Eigen::Vector3d force_World_N = Eigen::Vector3d::Zero();
    Eigen::Vector3d torque_World_Nm = Eigen::Vector3d::Zero();
    double left_s = 0;
    Eigen::Vector3d p_ComPoint_Body_m = Eigen::Vector3d::Zero();  // where it acts, moving along
  };
  // The point's offset from the centre of mass in the body's axes, as a push wants it.
  [[nodiscard]] Eigen::Vector3d point_of_body(const Eigen::Vector3d& p_World_m) const;
  // Acts in every physics step of the time that it has left; a new push takes the place of the old one.
  void push(const Push& push);
  // Before every physics step.
  void apply_push(double step_s);

  // Objects at rest for a while sleep until something touches or moves them; counted in physics steps.
  void rest_if_quiet(double step_s);
  [[nodiscard]] bool hardly_moves() const;
  void wake();

  struct Motion {
    Eigen::Isometry3d X_WorldObject = Eigen::Isometry3d::Identity();  // static objects only
    std::array<dReal, 3> position{};
    std::array<dReal, 4> quaternion{};
    std::array<dReal, 12> rotation{};
    std::array<dReal, 3> velocity{};
    std::array<dReal, 3> angular_velocity{};
    bool enabled = true;
    double quiet_s = 0;
    Push push;
  };
  [[nodiscard]] Motion motion() const;
  void set_motion(const Motion& motion);

 private:
  void apply_mass();

  ObjectDescription description_;
  dBodyID body_ = nullptr;
  std::vector<dGeomID> geoms_;
  std::vector<dTriMeshDataID> mesh_data_;
  Eigen::Vector3d p_ObjectCom_m_ = Eigen::Vector3d::Zero();
  Eigen::Isometry3d X_WorldStatic_ = Eigen::Isometry3d::Identity();
  double quiet_s_ = 0;
  Push push_;
};

// Bit-exact copies of a body's motion; ODE's setters normalise and so round.
ObjectBody::Motion read_motion(dBodyID body);
void write_motion(dBodyID body, const ObjectBody::Motion& motion);

}  // namespace nido::sim
