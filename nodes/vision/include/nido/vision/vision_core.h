#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/camera.h"
#include "nido/kinematics/robot_model.h"
#include "nido/vision/gaze_controller.h"
#include "nido/vision/hand_finder.h"
#include "nido/vision/head_history.h"
#include "nido/vision/learner.h"
#include "nido/vision/object_tracker.h"

namespace nido::vision {

struct VisionSettings {
  TrackerSettings tracker;
  HandFinderSettings hand;
  GazeSettings gaze;
  double period_s = 0.01;        // between steps
  int min_blob_px = 12;          // smaller patches of colour are not looked at
  double noisy_levels = 2.0;     // pictures with more noise are smoothed, with twice as much twice
  double fast_head_rad_s = 1.2;  // beyond this no new thing is believed
};

// What came in since the last step. Empty means: nothing new.
struct VisionInputs {
  std::optional<Image> left;
  std::optional<Image> right;
  std::optional<CameraInfo> left_info;
  std::optional<CameraInfo> right_info;
  std::vector<EncoderSample> head;   // oldest first; 6 joints
  std::vector<EncoderSample> torso;  // oldest first; yaw, roll, pitch
  std::optional<GazeGoal> gaze;
  // Somebody shows a thing in the middle of the left picture and says what it is called: "banana".
  std::optional<std::string> called;
};

struct VisionOutputs {
  // Set when a pair of pictures was worked on in this step.
  std::optional<Time> pictures_stamp;
  std::vector<SeenObject> objects;
  std::array<SeenHand, 2> hands;  // left, right
  // Set once the head's encoders are known.
  std::optional<GazeController::Output> gaze;
  // A thing that was shown is known now, or could not be learned: a sentence.
  struct Taught {
    std::string name;
    bool learned = false;
    std::string text;
  };
  std::optional<Taught> taught;
  // Sentences about inputs that were refused.
  std::vector<std::string> warnings;
};

// All that the vision node does, without ports: pictures, encoders and a gaze goal in; things, hands and head
// commands out. Knows the body's kinematics and what things look like; never where they are. One thread.
class VisionCore {
 public:
  static Result<std::unique_ptr<VisionCore>> create(const RobotModel& model, const TemplateSet& templates,
                                                    const VisionSettings& settings);
  VisionOutputs step(Time now, VisionInputs inputs);
  // What it knows of things, those that it was taught included.
  [[nodiscard]] const TemplateSet& templates() const { return templates_; }

 private:
  VisionCore(const RobotModel& model, const TemplateSet& templates, const VisionSettings& settings);
  void look(Time stamp, VisionOutputs& out);
  void learn(const StereoBlobs& pictures, VisionOutputs& out);
  [[nodiscard]] EyePair eyes_at(Time stamp) const;

  RobotModel model_;
  TemplateSet templates_;
  VisionSettings settings_;
  std::array<PinholeCamera, 2> cameras_;
  std::array<int, 2> camera_links_{};
  int head_first_ = 0;
  int torso_first_ = 0;
  std::array<Image, 2> images_;
  std::array<bool, 2> fresh_{};
  EncoderHistory head_{6};
  EncoderHistory torso_{3};
  std::array<BlobFinder, 2> finders_;
  ObjectTracker tracker_;
  HandFinder hand_finder_;
  std::optional<Learner> learner_;  // while a thing is shown
  std::string learning_;            // its name
  int tries_ = 0;                   // pairs of pictures since then
  std::optional<GazeController> gaze_;
  std::array<std::optional<Eigen::Vector3d>, 2> p_RootHand_m_;  // last seen
  std::array<Time, 2> hand_seen_;
};

}  // namespace nido::vision
