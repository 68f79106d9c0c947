#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <numbers>
#include <optional>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// Control in the space of the task: a pose of the hand, a point to look at. Root frame of the robot (x
// backward, y to the robot's right, z up), m. All functions are thread-safe and wait for no motion. They move
// the joints of their chain in mode direct; whoever else commands these joints meanwhile fights with them.

// Where the hand shall go.
struct CartesianGoal {
  // Palm frame: x towards the fingers, y away from the thumb, z out of the palm (right hand). With another
  // tip (CartesianSettings) its frame.
  Eigen::Isometry3d X_RootPalm = Eigen::Isometry3d::Identity();
  bool with_orientation = true;  // false: the position alone counts
  double duration_s = 0;         // 0: as long as the joints need at half their top speed
};

// What it would take.
struct CartesianPlan {
  std::vector<double> joints_rad;  // in the order of the chain: torso (yaw, roll, pitch), arm
  double position_error_m = 0;     // what is left when they are there
  double turn_error_rad = 0;
  Eigen::Isometry3d X_RootPalm = Eigen::Isometry3d::Identity();  // then
};

struct CartesianState {
  std::int64_t stamp_ns = 0;                                     // of the encoders
  Eigen::Isometry3d X_RootPalm = Eigen::Isometry3d::Identity();  // by the encoders; of the tip, if another
  bool moving = false;
  double position_error_m = 0;  // from the goal that was asked for last; 0 before the first
  double turn_error_rad = 0;
  // 0..1: how much of the motion's time is over, or was when it was ended: less than 1 when a speed came to a
  // limit of the joints.
  double progress = 1;
  std::vector<double> velocities_rad_s;               // of the chain's joints
  Eigen::Vector3d v_m_s = Eigen::Vector3d::Zero();    // of the tip, by these
  Eigen::Vector3d w_rad_s = Eigen::Vector3d::Zero();  // its turn
  // Number of the motion, 0 before the first: every order begins a new one, except a speed that follows a
  // speed.
  std::uint32_t motion = 0;
};

// What moves and how. All joints of the chain in its order: torso (yaw, roll, pitch), arm.
struct CartesianSettings {
  std::vector<bool> moves;        // false: stays where it is
  std::vector<double> lower_rad;  // within the joints' own limits
  std::vector<double> upper_rad;
  // Where a goal leaves freedom a joint stays near where it is, or near this.
  std::vector<std::optional<double>> rest_rad;
  Eigen::Isometry3d X_PalmTip =
      Eigen::Isometry3d::Identity();  // what is brought to goals, in the palm's frame
};

// How long a speed of the hand holds that nobody repeats, unless a time is asked for.
inline constexpr double kTaskSpeedHolds_s = 0.1;

class ICartesianControl {
 public:
  virtual ~ICartesianControl() = default;
  [[nodiscard]] virtual Result<CartesianState> state() const = 0;
  // The posture that a motion would end in, with nothing moved. Out of reach it is the nearest one. Takes
  // well under a millisecond. kInvalidArgument for what is not finite or no turn.
  [[nodiscard]] virtual Result<CartesianPlan> plan(const CartesianGoal& goal) const = 0;
  // Starts a motion: minimum-jerk along the straight line, the turn with it, within the limits of the joints.
  // Replaces a motion under way. kFailed, with how near the best posture comes, when the goal is more than
  // 2 mm or 1 degree out of reach; nothing moves then.
  virtual Status go_to(const CartesianGoal& goal) = 0;
  // The tip goes on at this speed for so long of the robot's time, then the joints stay where they are: who
  // wants more says it again in time, so that a hand whose commander is gone stops. Ends sooner with another
  // order, or when a joint's limit keeps the tip from following. kInvalidArgument beyond 2 m/s, 10 rad/s, and
  // for a time that is not 0 to 60 s.
  virtual Status go_on(const Eigen::Vector3d& v_m_s, const Eigen::Vector3d& w_rad_s, double for_s) = 0;
  // The joints stay where they are.
  virtual Status stop() = 0;
  // Where the body behind a joint is, counted from the root (torso pitch, roll, yaw, then the arm): the frame
  // in which the next joint turns about z; behind the last joint the tip's.
  [[nodiscard]] virtual Result<Eigen::Isometry3d> X_RootLink(int joint_from_root) const = 0;
  [[nodiscard]] virtual Result<CartesianSettings> settings() const = 0;
  // Holds from the next motion on; the tip stays while one is under way (kFailed). kInvalidArgument, and
  // nothing is changed, for settings that do not fit the chain or leave its limits.
  virtual Status set_settings(const CartesianSettings& settings) = 0;
};

struct GazeState {
  std::int64_t stamp_ns = 0;                                   // of the encoders
  Eigen::Vector3d p_RootFixation_m = Eigen::Vector3d::Zero();  // where the lines of sight meet; far: 10 m
  bool moving = false;
  double error_px = 0;  // of the point asked for, from the image centre, in the worse eye; 0 before the first
  // Azimuth (to the right), elevation (up) and vergence of the fixation point, rad, seen from the middle
  // between the eyes of a robot that looks straight ahead, torso upright.
  Eigen::Vector3d angles_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d torso_rad = Eigen::Vector3d::Zero();  // joints, in the order of their board
  Eigen::Matrix<double, 6, 1> head_rad = Eigen::Matrix<double, 6, 1>::Zero();
  // Optical frames, left and right: z along the line of sight, x right and y down in the picture.
  std::array<Eigen::Isometry3d, 2> X_RootEyes = {Eigen::Isometry3d::Identity(),
                                                 Eigen::Isometry3d::Identity()};
  double progress = 1;                                                           // 0..1, as of a hand
  Eigen::Matrix<double, 6, 1> wanted_rad = Eigen::Matrix<double, 6, 1>::Zero();  // where the head's joints go
  Eigen::Matrix<double, 6, 1> velocities_rad_s = Eigen::Matrix<double, 6, 1>::Zero();
  // Between the eyes, fixed to the head: z forward, x right, y down.
  Eigen::Isometry3d X_RootHead = Eigen::Isometry3d::Identity();
};

// What of the head never changes.
struct GazeBody {
  int width_px = 0;  // of the eyes' pictures
  int height_px = 0;
  double focal_px = 0;
  // Of a robot that looks straight ahead, torso upright: the middle between the eyes, turned as they are.
  Eigen::Isometry3d X_RootAhead = Eigen::Isometry3d::Identity();
  double baseline_m = 0;  // from eye to eye
  // How far the joints may turn: neck pitch, roll, yaw; the vergence.
  Eigen::Vector3d neck_lower_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d neck_upper_rad = Eigen::Vector3d::Zero();
  double vergence_upper_rad = 0;
};

struct GazeSettings {
  // How long a motion takes, or longer where a joint needs it. The eyes look there first, and turn back as
  // the neck comes after.
  double neck_s = 0.75;
  double eyes_s = 0.25;
  // Neck pitch, roll, yaw; within the joints' own limits.
  Eigen::Vector3d neck_lower_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d neck_upper_rad = Eigen::Vector3d::Zero();
  // The eyes look straight ahead with this vergence, and the neck does the rest: points are seen in the
  // middle between both eyes' pictures.
  std::optional<double> vergence_rad{};
  // 0..1: how much of the head's turning the eyes make up for while the neck is on its way. 1: they keep the
  // point in sight; 0: they go where they will be in the end, and the neck carries them.
  double eyes_make_up = 1;
  // Saccades: to a point this far or farther from where the eyes look, and not sooner after the last one, the
  // eyes go as fast as they can, whatever eyes_s says.
  struct Saccades {
    double from_rad = std::numbers::pi / 12;
    double apart_s = 0.2;
  };
  std::optional<Saccades> saccades{};
};

class IGazeControl {
 public:
  virtual ~IGazeControl() = default;
  [[nodiscard]] virtual Result<GazeState> state() const = 0;
  // Turns neck and eyes until both eyes see the point in the middle of their pictures, and keeps it there
  // while the torso moves. kFailed when neck and eyes cannot turn so far, with how far they can.
  virtual Status look_at(const Eigen::Vector3d& p_Root_m) = 0;
  // Looks at what is seen at a pixel now, at a distance along its line of sight; eye 0 left, 1 right.
  virtual Status look_at_pixel(int eye, const Eigen::Vector2d& px, double distance_m) = 0;
  // Looks at the point that one picture shows at one pixel and the other at the other: nearest to both lines.
  // kInvalidArgument when the lines do not meet before the eyes.
  virtual Status look_at_pixels(const Eigen::Vector2d& left_px, const Eigen::Vector2d& right_px) = 0;
  // Looks in a direction: azimuth, elevation and vergence as in GazeState; relative: as seen from the middle
  // between the eyes as they look now. A vergence below 1 degree is taken for 1 degree.
  virtual Status look_by_angles(bool relative, const Eigen::Vector3d& angles_rad) = 0;
  // Head and eyes stay where they are.
  virtual Status stop() = 0;
  [[nodiscard]] virtual Result<GazeBody> body() const = 0;
  [[nodiscard]] virtual Result<GazeSettings> settings() const = 0;
  // Holds from the next motion on. kInvalidArgument, and nothing is changed, for what leaves the joints'
  // limits or the ranges above.
  virtual Status set_settings(const GazeSettings& settings) = 0;
};

}  // namespace nido
