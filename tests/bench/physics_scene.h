#pragma once

#include <Eigen/Geometry>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/kinematics/robot_model.h"
#include "nido/simulator/simulation.h"

namespace nido::bench {

// One of the ten things of the scene; a box has three edges, a ball its radius in x.
struct Thing {
  std::string name;
  bool ball = false;
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();
  double mass_kg = 0.08;
};

// What every contender simulates: the robot with both hands held out palm up, the fingers closed round a ball
// in each of them, eight things on a table, and all 53 joints swinging.
class PhysicsScene {
 public:
  static constexpr double kTableTop_m = -0.25;
  static constexpr double kControlPeriod_s = 0.01;

  static Result<PhysicsScene> create(const std::string& urdf_path);

  [[nodiscard]] const std::string& urdf_path() const { return urdf_path_; }
  [[nodiscard]] const RobotModel& model() const { return model_; }
  [[nodiscard]] const std::vector<Thing>& things() const { return things_; }
  [[nodiscard]] const Thing& table() const { return table_; }
  // The world as the simulator reads it.
  [[nodiscard]] std::string world_yaml() const;
  // All axes, part after part, at a time: the hands close on their balls, all swings a little
  // about its posture, within the limits.
  [[nodiscard]] Eigen::VectorXd axes_rad(double time_s) const;
  [[nodiscard]] Eigen::VectorXd start_rad() const { return posture_rad_; }

 private:
  explicit PhysicsScene(RobotModel model) : model_(std::move(model)) {}

  std::string urdf_path_;
  RobotModel model_;
  Eigen::VectorXd posture_rad_;
  std::vector<Thing> things_;
  Thing table_;
};

// One way to simulate the scene.
class Contender {
 public:
  virtual ~Contender() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  // One control period of 10 ms in steps of 1 ms.
  virtual Status advance(const Eigen::VectorXd& axes_rad) = 0;
  // Touching points of the last step.
  [[nodiscard]] virtual int contacts() const = 0;
};

// The simulator itself, in variants that show what a sense costs.
struct NidoVariant {
  std::string name = "nido";
  bool self_collision = true;
  bool skin = true;              // the robot's description has its patches
  bool skin_is_pressed = false;  // a ball that nothing moves stands against each patch
};
Result<std::unique_ptr<Contender>> make_nido(const PhysicsScene& scene, const NidoVariant& variant);
// The same bodies and hinges straight on ODE: QuickStep, 20 iterations, a hash space.
Result<std::unique_ptr<Contender>> make_bare_ode(const PhysicsScene& scene);
#ifdef NIDO_WITH_MUJOCO
Result<std::unique_ptr<Contender>> make_mujoco(const PhysicsScene& scene);
#endif

}  // namespace nido::bench
