#pragma once

#include <optional>
#include <random>
#include <string>

#include "nido/interfaces/result.h"
#include "nido/kinematics/camera_geometry.h"
#include "nido/kinematics/gaze_solver.h"
#include "nido/kinematics/robot_model.h"
#include "nido/reach/posture_drawer.h"

namespace nido::calibration {

// How the body shall stand to look at its hand.
struct Pose {
  reach::Joints arm_rad = reach::Joints::Zero();  // torso (at zero) and arm
  HeadAngles head_rad = HeadAngles::Zero();
};

// Draws poses in which both eyes see the hand, each time from another turn of the neck and somewhere else in
// the pictures: what differs from pose to pose is what calibration learns from. Thread-compatible.
class PoseChooser {
 public:
  // kNotFound or kInvalidArgument when the model lacks eyes or the hand.
  static Result<PoseChooser> create(const RobotModel& model, const std::string& side,
                                    const PinholeCamera& camera, std::uint64_t seed);

  // What is believed about the body by now.
  void believe(const RobotModel& model) { model_ = model; }
  // The next pose; `now` is where the arm is. Nothing when no pose was found in which eyes and hand meet.
  [[nodiscard]] std::optional<Pose> next(const reach::Joints& now);
  // Where the marks should be in the pictures, px: [eye][knuckle, wrist]; nothing where they are out of view.
  [[nodiscard]] std::array<std::array<std::optional<Eigen::Vector2d>, 2>, 2> expected_px(
      const Eigen::VectorXd& axes_rad) const;
  // Encoders as a vector of all axes.
  [[nodiscard]] Eigen::VectorXd axes(const reach::Joints& arm_rad, const HeadAngles& head_rad) const;

 private:
  PoseChooser(const RobotModel& model, const reach::ArmChain& chain, const std::string& side,
              const PinholeCamera& camera, std::uint64_t seed);
  [[nodiscard]] std::optional<HeadAngles> look_at_hand(const reach::Joints& arm_rad);

  RobotModel model_;
  reach::PostureDrawer drawer_;
  PinholeCamera camera_;
  std::mt19937_64 random_;
  std::array<int, 2> eyes_{};   // links
  std::array<int, 2> marks_{};  // links: knuckle, wrist
  int head_first_ = 0, torso_first_ = 0, arm_first_ = 0;
  HeadAngles lower_ = HeadAngles::Zero();
  HeadAngles upper_ = HeadAngles::Zero();
};

}  // namespace nido::calibration
