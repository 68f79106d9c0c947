#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/kinematics/body_corrections.h"
#include "nido/kinematics/camera_geometry.h"
#include "nido/kinematics/robot_model.h"

namespace nido::calibration {

// The hand as both eyes saw it while the body rested in one pose.
struct PoseView {
  Eigen::VectorXd axes_rad;  // encoders: all axes of the model; those that do not matter are 0
  // Centre of each mark in each picture, px: [left eye, right eye][knuckle, wrist]; nothing where it was not
  // seen.
  std::array<std::array<std::optional<Eigen::Vector2d>, 2>, 2> mark_px;
};

// One number of the body that is not taken from the drawing on trust.
struct Unknown {
  std::string link;       // that it moves (BodyCorrections)
  int component = 0;      // 0-2: moved along x, y, z of its frame, m; 3-5: turned about them, rad
  double expected = 0.0;  // how far off it may well be (standard deviation), m or rad
};

// Zeros of the encoders of neck, eyes and arm, how the eyes sit in their sockets, the lengths of upper arm
// and forearm, and what is seen of the mark at the wrist. The mark at the knuckles is taken as drawn: its
// middle is what "the hand's position" means. The torso is taken as drawn: it moves eyes and hand together,
// which no look at the hand can tell.
std::string wrist_mark(const std::string& side);  // its link
std::vector<Unknown> default_unknowns(const std::string& side);

struct Calibration {
  BodyCorrections corrections;
  double rms_px = 0.0;  // of what was seen, against what the corrected body predicts; wild sightings left out
  int poses = 0;        // used
  int wild = 0;         // marks that were seen more than five times the usual error off
  int iterations = 0;
};

// Finds the corrections under which the pictures agree best with the encoders: robust non-linear least
// squares (Levenberg-Marquardt, Cauchy weights), each unknown held near the drawing by how far off it may be.
// A few seconds at most. Deterministic. kInvalidArgument with fewer than 3 poses, a link that the model
// lacks, or a number that is not finite.
Result<Calibration> calibrate(const RobotModel& drawn, const std::string& side,
                              const std::array<PinholeCamera, 2>& cameras, const std::vector<PoseView>& views,
                              const std::vector<Unknown>& unknowns);

// Views as a text file (docs/calibration.md), with the cameras.
struct ViewsFile {
  std::array<PinholeCamera, 2> cameras;
  std::vector<PoseView> views;
};
Status save_views(const std::filesystem::path& path, const ViewsFile& views, const std::string& command);
Result<ViewsFile> load_views(const std::filesystem::path& path);

}  // namespace nido::calibration
