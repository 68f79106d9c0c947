#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/reach/reach_core.h"

namespace nido::reach {

// Where the reaching process finds what it needs.
struct SettingsPaths {
  std::string urdf = "config/robots/icub.urdf";
  std::string calibration = "";  // what self-calibration found (docs/calibration.md); empty: as the URDF says
  std::string postures = "config/robots/grasp_postures.yaml";  // how to hold the right palm to each shape
  std::string posture_weights = "config/weights/reach_posture.txt";  // the paper's network
  std::string hand_weights = "config/weights/reach_hand.txt";        // where the eyes see the hand
};

// The chain and the mark of one hand, from the robot model: the mark "knuckle" is the one whose pose vision
// reports.
struct Body {
  ArmChain chain;
  Eigen::Vector3d p_PalmMark_m = Eigen::Vector3d::Zero();
};
Result<Body> load_body(const std::string& urdf_path, const std::string& calibration_path,
                       const std::string& side);

// Planner with the default home, limits and speeds (docs/reach.md).
PlannerOptions default_planner_options();

// What is learned with one hand has a file a hand: weights_file("reach_hand", "left") is
// "reach_hand_left.txt"; that of the right hand is "reach_hand.txt".
std::string weights_file(const std::string& what, const std::string& side);

// The shipped files for a hand, in the folder `config`.
SettingsPaths shipped_paths(const std::filesystem::path& config, const std::string& side);

// How the right hand stands over a thing without touching it.
PalmPosture default_reach_posture();

// The same for the other hand: mirrored at the plane between left and right.
PalmPosture mirrored(const PalmPosture& posture);

// For the right hand: grasp_postures.yaml. kNotFound, or kInvalidArgument with file, line, what was found and
// what was expected.
Result<std::map<std::string, PalmPosture>> load_grasp_postures(const std::string& path);

// Everything put together. Fails when a file is missing or wrong, naming it and the command that makes it.
Result<ReachCore> make_reach_core(const SettingsPaths& paths, const std::string& side,
                                  bool paper_network_alone, const PlannerOptions& planner);

}  // namespace nido::reach
