#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/simulator/faults.h"
#include "nido/simulator/film.h"
#include "nido/simulator/joints.h"
#include "nido/simulator/scene.h"
#include "nido/simulator/skin.h"

namespace nido::sim {

// What holds the robot's root: the world; the same with a stand to be seen and touched; nothing, so that it
// stands on its feet and can fall.
enum class Base { kFixed, kStand, kFree };

// What a simulation is made from.
struct SimulationOptions {
  std::filesystem::path urdf_path;   // config/robots/icub.urdf
  std::filesystem::path world_path;  // config/worlds/NAME.yaml; empty: world_yaml is used
  std::string world_yaml;            // a world as text, when world_path is empty; both empty: only the floor
  std::string target;  // random worlds: the object that must be there ("blue cube"); empty: the seed chooses
  std::uint64_t seed = 1;         // of random worlds and of the constraint solver
  double physics_step_s = 0.001;  // must divide the control period of 10 ms
  int solver_iterations = 20;     // most in every physics step
  bool self_collision = true;     // the robot's limbs and fingers touch each other
  Base base = Base::kFixed;
  Lighting light;  // of the room, at the start and after a reset
  // Where the world port keeps what it saves, scenes and snapshots; made when needed. The port writes nowhere
  // else.
  std::filesystem::path scene_folder = "out/scenes";
};

enum class Hand { kLeft, kRight };
enum class Eye { kLeft, kRight };

// Touch pads of one hand, in the order thumb, index, middle, ring, little finger tip, palm.
inline constexpr std::size_t kPadCount = 6;
struct HandTouch {
  std::array<bool, kPadCount> on{};  // contact with anything that is not the robot
  std::array<double, kPadCount>
      force_N{};  // sum of the normal contact forces, mean over the last control period
};

// Where an object of the world is and what it is. Poses are those of the object's frame: centre of a box,
// sphere or cylinder; middle of the floor plate's underside for a basket; between the feet for a bear.
struct ObjectState {
  std::string name;        // "blue cube"; unique
  std::string kind;        // world vocabulary: "box", "sph", "cyl", "model", "sbox", ...; or "basket", "bear"
  bool is_static = false;  // nothing moves it
  double mass_kg = 0;      // 0 for static objects
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();  // edges of its box in its own frame
  Eigen::Isometry3d X_WorldObject = Eigen::Isometry3d::Identity();
  Eigen::Vector3d v_World_m_s = Eigen::Vector3d::Zero();  // velocity of the centre of mass
  Eigen::Vector3d w_World_rad_s = Eigen::Vector3d::Zero();
};

// One touching pair, summed over its contact points, at the end of the last control period.
struct ContactPair {
  std::string a;  // object name, "floor", "table", or robot link name
  std::string b;
  bool a_is_robot = false;
  bool b_is_robot = false;
  double force_N = 0;                                   // sum of normal forces
  double depth_m = 0;                                   // deepest penetration
  Eigen::Vector3d p_World_m = Eigen::Vector3d::Zero();  // mean contact point
};

// Who touches an object: for the judge and for tests, never for a node that perceives or acts.
struct HoldQuery {
  std::array<bool, kPadCount> left{};  // pads of the left hand (a whole finger counts, not only its tip)
  std::array<bool, kPadCount> right{};
  bool other_robot_link = false;  // forearm, head, ...
  bool world = false;             // table, floor, basket or another object
  // Borne by the robot alone: some finger or palm touches it, and nothing of the world does.
  [[nodiscard]] bool held() const;
};

// Everything that changes in a simulation, to come back to later. Opaque; valid for the Simulation that made
// it as long as no object is made or deleted.
class SavedState {
 public:
  SavedState();
  ~SavedState();
  SavedState(const SavedState&);
  SavedState(SavedState&&) noexcept;
  SavedState& operator=(const SavedState&);
  SavedState& operator=(SavedState&&) noexcept;

 private:
  friend class Simulation;
  struct Data;
  std::unique_ptr<Data> data_;
};

// A hash as it is written: 16 hexadecimal digits.
[[nodiscard]] std::string hash_word(std::uint64_t hash);

// A robot in a world of objects: physics, drives, touch, and the text vocabulary of the world port. No
// cameras (see the renderer, which draws its SceneSnapshot), no network.
//
// Not thread-safe; several simulations may run in several threads of one process at once. The same options
// and the same calls give the same state bit for bit on one machine. World frame W: iCub root axes (x
// backward, y right, z up), origin at the root, floor at z = -0.5976 m.
class Simulation {
 public:
  static constexpr double kControlPeriod_s = 0.01;
  static constexpr double kFloorHeight_m = -0.5976;

  // Fails with a sentence that names file and place when the URDF or world is wrong.
  static Result<std::unique_ptr<Simulation>> create(const SimulationOptions& options);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  // Time since creation or reset, a whole number of control periods.
  [[nodiscard]] double time_s() const;
  [[nodiscard]] std::int64_t time_ns() const;
  // Control periods that led to this state. Other than the time, which goes on, a snapshot brings it back:
  // what is drawn from it (the cameras' noise) is part of the same future.
  [[nodiscard]] std::uint64_t moment() const;
  // Advances by whole control periods; a duration is rounded to the nearest number of them, at least one.
  // Fails with the body's name when a body has left the realm of numbers; the simulation then stays failed
  // until reset() or restore().
  Status step(double duration_s = kControlPeriod_s);
  // Back to the state after creation (made objects vanish, deleted ones return); the same seed, so the same
  // future.
  void reset();

  // Fast there-and-back for learning. restore() refuses a state of another simulation or of other objects.
  [[nodiscard]] SavedState save() const;
  Status restore(const SavedState& state);
  // The whole state as the text of a snapshot file (docs/world.md), and back: with another simulation of the
  // same robot and base, in another process too, the same future. restore_snapshot() changes nothing when it
  // refuses; `source` names the text in failures.
  [[nodiscard]] std::string snapshot() const;
  Status restore_snapshot(const std::string& text, const std::string& source);

  // -- joints; part is an index into parts()
  // ------------------------------------------------------------------------
  [[nodiscard]] const std::vector<PartInfo>& parts() const;
  // Index of a part or nothing (-1).
  [[nodiscard]] int part_index(std::string_view name) const;
  [[nodiscard]] std::span<const JointState> joints(int part) const;
  // Commands some joints of a part: the mode is switched and the targets are set, all or none. Units by mode:
  // rad, rad, rad/s, N m, duty cycle; kIdle ignores the values' meaning but not their number. Finite values
  // beyond a limit are clamped to it. Refuses NaN, infinity, wrong indices, indices named twice, and unequal
  // lengths.
  Status command(int part, JointMode mode, std::span<const int> joints, std::span<const double> values);
  // The same for all joints of a part.
  Status command_all(int part, JointMode mode, std::span<const double> values);
  // Reference speed of position mode; clamped to the joint's velocity limit, refused when not finite or not
  // above zero.
  Status set_reference_speed(int part, int joint, double speed_rad_s);
  // Speed that a joint's servo asks for by error; 1 to 100, until the next reset. Joints that share hinges
  // share the mean.
  Status set_servo_gain(int part, int joint, double gain_1_s);
  // Ends the motion where the joint is now (position mode with the present position as target).
  Status stop(int part, int joint);
  // Puts joints to a position at once, at rest: for tests and to start trials. Refused beyond limits.
  Status place_joints(int part, std::span<const double> position_rad);

  // -- sensors
  // ------------------------------------------------------------------------------------------------------
  [[nodiscard]] const HandTouch& touch(Hand hand) const;
  // Patches of skin that the robot's description names; never changes.
  [[nodiscard]] const std::vector<SkinPatch>& skin() const;
  // Taxels of a patch that feel something that is not the robot, in the order of their values; mostly none.
  // Their forces sum to the normal forces of the contacts on the patch, but for contacts beside its taxels.
  [[nodiscard]] const std::vector<TaxelForce>& skin_touch(std::size_t patch) const;
  // Whether the robot's description has this hand with its pads, and this eye. Without them nothing is
  // touched, and the camera frame is the root's.
  [[nodiscard]] bool has_hand(Hand hand) const;
  [[nodiscard]] bool has_eye(Eye eye) const;
  // Camera frame of an eye: z along the optical axis, x to the right and y down in the image.
  [[nodiscard]] Eigen::Isometry3d X_WorldCamera(Eye eye) const;
  // What the camera of an eye does instead of its work; the world port says so.
  [[nodiscard]] CameraFault camera_fault(Eye eye) const;
  // What camera number `camera` remembers for its faults; each camera keeps its own number. Empty at the
  // start and after a reset, brought back by restore().
  [[nodiscard]] Film& film(std::size_t camera);
  // Head's inertial sensor in its own frame: what an accelerometer feels (gravity included) and the turn
  // rate.
  struct Inertial {
    Eigen::Quaterniond q_WorldSensor = Eigen::Quaterniond::Identity();
    Eigen::Vector3d acceleration_m_s2 = Eigen::Vector3d::Zero();
    Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();
  };
  [[nodiscard]] Inertial inertial() const;
  // What the limb beyond the sensor exerts on the body, at the sensor, in the sensor link's frame.
  struct Wrench {
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
    Eigen::Vector3d torque_Nm = Eigen::Vector3d::Zero();
  };
  // limb: "left_arm", "right_arm", "left_leg", "right_leg".
  [[nodiscard]] Result<Wrench> force_torque(std::string_view limb) const;

  // -- ground truth: for the renderer, the judge and tests
  // ------------------------------------------------------------
  [[nodiscard]] const std::vector<std::string>& link_names() const;
  [[nodiscard]] Result<Eigen::Isometry3d> X_WorldLink(std::string_view link) const;
  [[nodiscard]] std::vector<ObjectState> objects() const;
  [[nodiscard]] Result<ObjectState> object(std::string_view name) const;
  [[nodiscard]] std::vector<ContactPair> contacts() const;
  [[nodiscard]] Result<HoldQuery> hold(std::string_view object) const;
  // The object's centre is above the basket's floor, between its walls and below their rim plus the object's
  // own size.
  [[nodiscard]] Result<bool> is_inside(std::string_view object, std::string_view basket) const;
  // Everything to draw: robot, table, objects, floor. The revision changes when things are made, deleted or
  // recoloured.
  void scene(SceneSnapshot& out) const;
  // Hash of places, speeds, drives and touch, to compare runs; quick.
  [[nodiscard]] std::uint64_t state_hash() const;
  // Hash of the complete state: of all that a snapshot keeps, but the time and the pictures of broken eyes.
  // Takes about a millisecond.
  [[nodiscard]] std::uint64_t complete_hash() const;

  // -- the world port
  // ------------------------------------------------------------------------------------------------- One
  // line of the world vocabulary (docs/world.md): "world mk box 0.05 0.05 0.05 0 0.6 0.3 1 0 0". Replies
  // "[ok]", values, or `[fail] "reason"`; a refused line changes nothing.
  // Lines about time are for the owner of the clock: what to ask it comes in `clock_request`, else empty;
  // without one they are refused.
  std::string world(const std::string& line, std::string* clock_request = nullptr);

  // The inside; known to the library only.
  struct Impl;

 private:
  explicit Simulation(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace nido::sim
