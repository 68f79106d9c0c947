#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <string>

#include "nido/grasp/grasp_core.h"
#include "nido/reach/reach_core.h"
#include "nido/simulator/simulation.h"

namespace nido::grasp {

// A thing to take and how wrong its place is believed to be.
struct LabThing {
  std::string line;  // of the world file, without name and place: "object: cube"; or of the world port, "mk
                     // box 0.04 0.04 0.04"
  std::string name = "blue cube";
  Eigen::Vector2d place_m{-0.30, 0.06};
  double yaw_deg = 0;
  Eigen::Vector3d error_Root_m = Eigen::Vector3d::Zero();
};

struct LabResult {
  std::string trouble;   // what reach or grasp said when it failed; empty: nothing
  bool said_so = false;  // grasp itself believed at the end of the hold that it holds the thing
  double lifted_m = 0;   // at the end of the hold
  bool held = false;     // by the hand alone, in the air, at the end of the hold
  double slip_m = 0;     // in the palm, during the hold
  int steps_held = 0;    // control periods of the hold that it stayed up
  bool in_basket = false;
};

// The simulator with the reaching and the grasping process's insides on it, in one process and without ports:
// much faster than the app, and the same but for eyes and delays. Places are true ones plus a given error.
class GraspLab {
 public:
  // A table with the thing and a basket.
  GraspLab(const LabThing& thing, GraspCore::Policy policy);

  // Opens, goes there, closes, lifts, holds for `hold_s`.
  LabResult take(double hold_s);
  // After take(): over the basket, lets go.
  void drop(LabResult& result);

  [[nodiscard]] sim::Simulation& simulation() { return *simulation_; }
  // Middle of the thing's box in the root frame, and in the palm's.
  [[nodiscard]] Eigen::Vector3d p_Root_m() const;
  [[nodiscard]] Eigen::Vector3d p_Palm_m() const;
  // Has grasp failed, by its own word?
  [[nodiscard]] const GraspStatus& grasp_status() const { return grasp_status_; }

  // Asks one process or both, and runs until all asked are done; "" or what the first that failed said.
  std::string ask(const std::string& reach, const Eigen::Vector3d& p_Root_m, const std::string& grasp);
  void tick();

 private:
  void make_thing();

  LabThing thing_;
  std::unique_ptr<sim::Simulation> simulation_;
  std::unique_ptr<reach::ReachCore> reach_;
  std::unique_ptr<GraspCore> grasp_;
  int arm_ = 0;
  int torso_ = 0;
  std::uint32_t id_ = 0;
  reach::ReachInput reach_goal_;
  std::optional<GraspGoal> grasp_goal_;
  reach::ReachStatus reach_status_;
  GraspStatus grasp_status_;
};

}  // namespace nido::grasp
