#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nido/attention/surface_tracker.h"
#include "nido/interfaces/camera.h"
#include "nido/kinematics/robot_model.h"
#include "nido/vision/gaze_controller.h"
#include "nido/vision/head_history.h"

namespace nido::attention {

struct AttentionSettings {
  SurfaceSettings surface;
  vision::GazeSettings gaze;
  double period_s = 0.01;  // between steps
  double settle_s = 0.8;   // a first look takes this long at most, then whatever is in the middle counts
  double lead_s = 0.03;    // the eyes are sent to where the surface will be then
};

// What came in since the last step. Empty means: nothing new.
struct AttentionInputs {
  std::optional<Image> left;
  std::optional<Image> right;
  std::optional<CameraInfo> left_info;
  std::optional<CameraInfo> right_info;
  std::vector<vision::EncoderSample> head;        // oldest first; 6 joints
  std::vector<vision::EncoderSample> torso;       // oldest first; yaw, roll, pitch
  std::optional<Eigen::Vector3d> p_RootFixate_m;  // look there, and hold on to the surface that is there
};

struct AttentionOutputs {
  std::optional<Time> pictures_stamp;  // a pair was worked on in this step
  std::optional<Surface> surface;      // what was found in it
  double work_s = 0;                   // wall time that the pair took
  // Set once the head's encoders are known: position direct, in the board's order.
  std::optional<std::array<double, 6>> command_rad;
  std::vector<std::string> warnings;  // about inputs that were refused
};

// All that the attention node does, without ports: looks roughly where it is told, takes the surface that it
// finds there, and keeps that in the middle of both pictures by neck and eyes, wherever it goes. One thread.
class AttentionCore {
 public:
  static Result<std::unique_ptr<AttentionCore>> create(const RobotModel& model,
                                                       const AttentionSettings& settings);
  AttentionOutputs step(Time now, AttentionInputs inputs);

 private:
  AttentionCore(const RobotModel& model, const AttentionSettings& settings);
  void take_picture(std::size_t eye, std::optional<Image>& image, AttentionOutputs& out);
  [[nodiscard]] vision::EyePair eyes_at(Time stamp) const;
  void look(Time stamp, AttentionOutputs& out);

  RobotModel model_;
  AttentionSettings settings_;
  std::array<PinholeCamera, 2> cameras_;
  std::array<int, 2> camera_links_{};
  int head_first_ = 0;
  int torso_first_ = 0;
  std::array<Image, 2> images_;
  std::array<bool, 2> fresh_{};
  vision::EncoderHistory head_{6};
  vision::EncoderHistory torso_{3};
  SurfaceTracker tracker_;
  std::optional<vision::GazeController> gaze_;
  bool attending_ = false;                // somebody said where
  std::optional<Time> first_look_since_;  // on the way to what it was told to look at
  bool arrived_ = false;
  std::optional<Surface> surface_;  // last seen
};

}  // namespace nido::attention
