#pragma once

#include <ode/ode.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "contacts.h"
#include "control_block.h"
#include "drives.h"
#include "limb_forces.h"
#include "nido/simulator/simulation.h"
#include "objects.h"
#include "robot_body.h"
#include "simulation_state.h"
#include "world_file.h"

namespace nido::sim {

// Owns an ODE world; must outlive everything in it.
class OdeWorld {
 public:
  OdeWorld() : id_(dWorldCreate()) {}
  ~OdeWorld() { dWorldDestroy(id_); }
  OdeWorld(const OdeWorld&) = delete;
  OdeWorld& operator=(const OdeWorld&) = delete;
  [[nodiscard]] dWorldID id() const { return id_; }

 private:
  dWorldID id_;
};

// What a Simulation is inside. The world's text commands work on it too.
struct Simulation::Impl {
  SimulationOptions options;
  ControlBlock block;
  WorldDescription start;  // the world as it was made, for reset
  OdeWorld world;
  std::unique_ptr<RobotBody> robot;
  std::unique_ptr<Drives> drives;
  std::unique_ptr<Contacts> contacts;
  std::unique_ptr<LimbForces> limb_forces;
  ContactSolver solver;
  std::vector<dBodyID> free_bodies;  // of the objects
  std::vector<ObjectJoint> joints;   // between objects
  std::vector<ContactSolver::Tie> ties;
  std::string* clock_request = nullptr;  // where a line leaves what to ask the clock's owner; null: nowhere
  std::vector<std::unique_ptr<ObjectBody>> objects;
  std::int64_t period = 0;       // control periods since the start
  std::uint64_t moment = 0;      // control periods that led here; restored with a state
  std::uint64_t revision = 1;    // of what there is to draw
  std::uint64_t object_set = 0;  // which set of objects this is; another one when some are made or deleted
  std::uint64_t last_object_set = 0;  // highest number that was given
  std::string model_folder = ".";     // where the world vocabulary looks for models
  std::string failure;                // why the simulation stopped; empty: it runs
  std::vector<std::string> link_names;
  std::array<RobotBody::Frame, 2> cameras;
  std::array<Eigen::Vector3d, 2> head_velocity = {
      Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};  // of the inertial sensor, now and a period before
  RobotBody::Frame inertial;
  std::array<CameraFault, 2> camera_fault{};  // left, right
  std::vector<Film> films;                    // by camera; see Simulation::film()
  Lighting light;

  std::map<std::string, WorldSnapshot> snapshots;  // by the names that the world port gave them

  // Puts these in place of all objects and joints; a failure changes nothing.
  Status replace_objects(const std::vector<ObjectDescription>& wanted,
                         const std::vector<ObjectJointDescription>& wanted_joints);
  void build_objects();
  void erase_object(std::size_t index);
  void reset();
  [[nodiscard]] SimulationState state() const;
  // Of the same robot, and as many objects.
  void set_state(const SimulationState& state);
  [[nodiscard]] StateShape state_shape() const;
  [[nodiscard]] WorldSnapshot snapshot() const;
  void restore(const WorldSnapshot& snapshot);
  // See Simulation::scene().
  void scene(SceneSnapshot& out) const;
  // Index or -1.
  [[nodiscard]] int find_object(std::string_view name) const;
  [[nodiscard]] bool is_inside(std::size_t object, std::size_t basket) const;
  // Limbs on the fixed root (legs; torso with arms and head) whose joints all stand still are not simulated
  // until something moves or touches them.
  void rest_still_limbs();
  // Everything that sleeps looks again whether it still lies on something.
  void wake_all();
  [[nodiscard]] Status check_finite() const;
  [[nodiscard]] Eigen::Isometry3d pose(const RobotBody::Frame& frame) const {
    return robot->X_WorldLink(static_cast<std::size_t>(frame.link)) * frame.X_LinkFrame;
  }
  [[nodiscard]] Eigen::Vector3d velocity_of(const RobotBody::Frame& frame) const;
};

// The world port's vocabulary; docs/world.md.
std::string run_world_command(Simulation::Impl& simulation, const std::string& line);

}  // namespace nido::sim
