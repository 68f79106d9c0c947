#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "nido/kinematics/camera_geometry.h"
#include "nido/kinematics/robot_model.h"
#include "nido/middleware/time.h"

namespace nido::vision {

// Where somebody asks the robot to look.
struct GazeGoal {
  std::string mode = "rest";  // "rest", "search" (scan the table), "object" (target: its name), "hand"
                              // (target: side), "point"
  std::string target;
  Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();  // for "point"
};

// What vision knows about the goal's target.
struct GazeTarget {
  Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();
  double age_s = 0;  // since it was seen last
};

struct GazeStatus {
  std::string mode;
  std::string target;
  bool fixated =
      false;  // the target is seen now, within a few pixels of both image centres, and the head is still
  bool search_done =
      false;  // a whole scan was made without finding the target; stays until it is found or the goal changes
};

struct GazeSettings {
  double neck_speed_rad_s = 0.7;
  double eye_speed_rad_s = 1.5;
  double neck_time_s = 0.25;            // how softly the neck follows
  double eyes_tilt_wanted_rad = -0.20;  // the neck does the rest of looking up and down
  double margin_rad = 0.03;             // kept to every joint limit
  double fixated_px = 8;
  double still_rad_s = 0.12;
  double lost_s = 1.5;    // a target that is not seen for this long is searched again
  double dwell_s = 0.35;  // a still view of this length is a look
  Eigen::Vector3d p_RootRest_m = {-0.31, 0.08, -0.06};
  // places that together show the whole table
  std::vector<Eigen::Vector3d> scan_Root_m = {{-0.31, 0.08, -0.06},
                                              {-0.30, 0.26, -0.06},
                                              {-0.42, 0.12, -0.06},
                                              {-0.42, -0.16, -0.06},
                                              {-0.30, -0.22, -0.06}};
};

// Turns head and eyes so that a target comes to the middle of both images. The eyes follow at once, the neck
// softly and as far as needed. Order of the six head joints as on the board: neck pitch, roll, yaw, eyes
// tilt, version, vergence. One thread.
class GazeController {
 public:
  // The model must outlive the controller. Fails if it has no head, torso or cameras as an iCub's.
  static Result<GazeController> create(const RobotModel& model, const PinholeCamera& camera,
                                       GazeSettings settings);

  // Refuses an unknown mode or a target that is missing or not finite, and keeps the goal before.
  Status set_goal(const GazeGoal& goal);
  [[nodiscard]] const GazeGoal& goal() const { return goal_; }

  using HeadJoints = std::array<double, 6>;
  struct Output {
    HeadJoints command_rad{};  // position direct
    GazeStatus status;
  };
  // One control period. `head_rad` and `torso_rad` are encoders (torso: yaw, roll, pitch); `target` what is
  // remembered of the goal's target, if anything.
  Output step(Time now, double period_s, const HeadJoints& head_rad, const std::array<double, 3>& torso_rad,
              double head_speed_rad_s, const std::optional<GazeTarget>& target);

  // Joints that look at a point with the given preferred tilt of the eyes and no version, clamped to the
  // limits; then the eyes turned to what the neck cannot do.
  [[nodiscard]] HeadJoints solve(const Eigen::Vector3d& p_Root_m, const std::array<double, 3>& torso_rad,
                                 const HeadJoints& start_rad) const;

 private:
  GazeController(const RobotModel& model, const PinholeCamera& camera, GazeSettings settings);
  // Turns the chosen joints until the point is in the middle of both images.
  void centre(const Eigen::Vector3d& p_Root_m, const std::array<double, 3>& torso_rad,
              const std::vector<int>& joints, HeadJoints& head) const;
  [[nodiscard]] Eigen::Vector4d pixel_error(const Eigen::Vector3d& p_Root_m,
                                            const std::array<double, 3>& torso_rad,
                                            const HeadJoints& head) const;
  [[nodiscard]] Eigen::Vector3d choose_point(Time now, bool still, const std::optional<GazeTarget>& target);

  const RobotModel* model_;
  PinholeCamera camera_;
  GazeSettings settings_;
  int head_first_ = 0;
  int torso_first_ = 0;
  std::array<int, 2> camera_links_{};
  HeadJoints lower_{};
  HeadJoints upper_{};

  GazeGoal goal_;
  bool started_ = false;
  HeadJoints command_{};
  std::array<double, 3> neck_speed_{};
  Eigen::Vector3d p_RootLook_m_ = Eigen::Vector3d::Zero();
  // scanning
  std::size_t scan_place_ = 0;
  std::optional<Time> still_since_;
  bool search_done_ = false;
  bool lost_ = false;
};

}  // namespace nido::vision
