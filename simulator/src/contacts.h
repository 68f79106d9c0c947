#pragma once

#include <ode/ode.h>

#include <array>
#include <memory>
#include <vector>

#include "contact_solver.h"
#include "control_block.h"
#include "nido/simulator/faults.h"
#include "nido/simulator/simulation.h"
#include "object_joints.h"
#include "objects.h"
#include "robot_body.h"
#include "skin.h"

namespace nido::sim {

// Which things touch: finds contacts before every physics step, gives them to the solver, and reads their
// forces after it. Geoms are visited in a fixed order, so that the solver's rows do not depend on how a state
// was reached.
class Contacts {
 public:
  Contacts(RobotBody& robot, const ControlBlock& block, std::vector<SkinPatch> patches);
  // From now on the robot touches itself, but for pairs of shapes of one link, of links within two hinges of
  // each other, or of one hand, and pairs that overlap in the posture in which it is now.
  void begin_self_collision();
  ~Contacts();
  Contacts(const Contacts&) = delete;
  Contacts& operator=(const Contacts&) = delete;

  using Objects = std::vector<std::unique_ptr<ObjectBody>>;

  // Makes the contact joints of this step, wakes what was touched, lets quiet things sleep that the robot
  // does not touch.
  void find(const Objects& objects, const std::vector<ObjectJoint>& joints, double step_s);
  // For the solver: it fills in the forces. In the order in which they were found.
  [[nodiscard]] std::vector<ContactSolver::Contact>& found() { return solved_; }
  // Sums what the solver made of them.
  void read_forces();
  // Forgets the sums of the period before.
  void begin_period();
  // Means of the period's steps; touch() and pairs() show them.
  void end_period();

  [[nodiscard]] const HandTouch& touch(Hand hand) const { return touch_[hand == Hand::kLeft ? 0 : 1]; }
  // hand: 0 left, 1 right. Until restore() or forgotten by a reset.
  void set_skin_fault(std::size_t hand, std::size_t pad, SkinFault fault) { skin_fault_[hand][pad] = fault; }
  [[nodiscard]] SkinFault skin_fault(std::size_t hand, std::size_t pad) const {
    return skin_fault_[hand][pad];
  }
  // Height of the lowest point of the robot's shapes.
  [[nodiscard]] double lowest_m() const;
  // The robot's shapes that touch, each on one of its links.
  [[nodiscard]] std::size_t robot_shape_count() const { return robot_geoms_.size(); }
  [[nodiscard]] std::size_t link_of_shape(std::size_t shape) const { return robot_geoms_[shape].link; }
  // Patches of skin: what touches their links presses them.
  [[nodiscard]] const Skin& skin() const { return skin_; }
  void set_patch_fault(std::size_t patch, SkinFault fault) { skin_.set_fault(patch, fault); }
  // Pairs that touch at the end of the last step.
  [[nodiscard]] std::vector<ContactPair> pairs(const Objects& objects) const;
  [[nodiscard]] HoldQuery hold(std::size_t object, const Objects& objects) const;

  // Force of all contacts on a link at the end of the last step, and its torque about a point of the world.
  void force_on_link(std::size_t link, const Eigen::Vector3d& p_World_m, Eigen::Vector3d& force_N,
                     Eigen::Vector3d& torque_Nm) const;

  // Where a point of the hand stuck to a point of an object. The solver stops after a few iterations, so
  // friction lets a held thing creep by about a millimetre a second; a stuck contact is therefore pulled back
  // to where it stuck, with no more force than friction allows.
  struct Grip {
    int robot_geom = -1;
    std::size_t object = 0;
    Eigen::Vector3d p_LinkAnchor_m = Eigen::Vector3d::Zero();    // in the frame of the link's body
    Eigen::Vector3d p_ObjectAnchor_m = Eigen::Vector3d::Zero();  // in the frame of the object's body
  };

  // What a contact bore in the step before: the solver starts from there.
  struct Load {
    ContactSolver::Side a;
    ContactSolver::Side b;
    int robot_geom = -1;
    Eigen::Vector3d p_World_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d force_World_N = Eigen::Vector3d::Zero();
    Eigen::Vector3d torque_World_Nm = Eigen::Vector3d::Zero();
  };

  // Who touches whom at a point.
  enum class OwnerKind { kFloor, kLink, kObject };
  struct Owner {
    OwnerKind kind = OwnerKind::kFloor;
    std::size_t index = 0;  // link or object
  };
  struct Touching {
    Owner a;
    Owner b;
    int robot_geom = -1;    // the robot's shape when a is a link
    int robot_geom_b = -1;  // and when b is one
    Eigen::Vector3d p_World_m = Eigen::Vector3d::Zero();
    double depth_m = 0;
    double force_N = 0;
  };

  using SkinFaults = std::array<std::array<SkinFault, kPadCount>, 2>;
  struct State {
    std::array<HandTouch, 2> touch;
    SkinFaults skin_fault{};
    Skin::State skin;
    std::vector<Grip> grips;
    std::vector<Load> loads;
    std::vector<Touching> touching;
  };
  [[nodiscard]] State save() const;
  void restore(const State& state);
  // Nothing touches, nothing is broken.
  void restart();
  // Drops all contacts and grips, as needed when objects come, go or are moved by hand.
  void forget();

 private:
  struct RobotGeom {
    dGeomID geom = nullptr;
    std::size_t link = 0;
    int hand = -1;     // 0 left, 1 right, -1 not part of a hand
    int finger = -1;   // 0 thumb ... 4 little, 5 palm
    bool pad = false;  // feels touch
    int patch = -1;    // of the skin that it wears
    Surface surface;
    std::string name;                  // URDF link
    std::array<dGeomID, 3> spheres{};  // capsules: both ends and the middle, for what ODE's capsule cannot do
    std::array<dReal, 6> aabb{};
  };
  // Two sides of a possible contact.
  struct Side {
    Owner owner;
    const Surface* surface = nullptr;
    dBodyID body = nullptr;
    int robot_geom = -1;
  };
  // Contacts of one pair of geoms; those nearer than `apart_m` to contacts since `first` are left out. True
  // if any was made.
  bool collide(dGeomID geom_a, dGeomID geom_b, const Side& a, const Side& b, std::size_t first,
               double apart_m);
  bool collide_robot(const RobotGeom& part, const Side& robot, dGeomID geom, const Side& object);
  void collide_self();
  // A robot whose base is free stands and falls on the floor; a fixed one never gets there.
  void collide_floor();
  bool collide_objects(const ObjectBody& a, std::size_t index_a, const ObjectBody& b, std::size_t index_b);
  // Finds or makes the grip of this contact and asks the solver to undo what it slipped.
  void stick(ContactSolver::Contact& contact, const Side& hand, const Side& object);
  // Gives the contact what it bore in the step before.
  void load(ContactSolver::Contact& contact, int robot_geom);
  [[nodiscard]] std::vector<Load> loads() const;
  [[nodiscard]] std::string name_of(const Owner& owner, int robot_geom, const Objects& objects) const;

  dGeomID floor_;
  RobotBody& robot_;
  std::vector<RobotGeom> robot_geoms_;
  std::vector<dTriMeshDataID> mesh_data_;
  std::vector<Touching> touching_;              // of this step
  std::vector<ContactSolver::Contact> solved_;  // the same ones, for the solver
  std::vector<Grip> grips_;                     // of this step
  std::vector<Grip> former_grips_;              // of the step before
  // pairs of robot_geoms_ that may touch; those of them that are near enough to do so in this control period
  std::vector<std::pair<int, int>> self_pairs_;
  std::vector<std::pair<int, int>> near_pairs_;
  std::vector<Load> former_loads_;  // of the step before
  bool loads_restored_ = false;     // they came with a saved state
  std::size_t next_load_ = 0;       // where the next contact probably finds its own
  std::array<HandTouch, 2> sum_{};
  std::array<HandTouch, 2> touch_{};
  SkinFaults skin_fault_{};
  Skin skin_;
  std::vector<Eigen::Isometry3d> X_PatchLink_;  // URDF link of a patch, from its moving link
  int steps_ = 0;
};

}  // namespace nido::sim
