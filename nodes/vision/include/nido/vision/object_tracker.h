#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nido/middleware/time.h"
#include "nido/vision/blob.h"
#include "nido/vision/stereo_fit.h"
#include "nido/vision/templates.h"

namespace nido::vision {

// One thing that is seen now.
struct SeenObject {
  std::string name;
  std::string colour;
  std::string shape;
  double confidence = 0;                                     // 0..1
  Eigen::Vector3d p_RootObject_m = Eigen::Vector3d::Zero();  // its centre
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();          // extents along root x, y, z
  double yaw_rad = 0;                          // of its main edge about root z; 0 for round things
  std::array<std::array<double, 4>, 2> box{};  // x, y, width, height in the left and right image, px
  bool occluded = false;                       // partly hidden: its place is remembered in part
};

struct TrackerSettings {
  double least_overlap = 0.62;      // of a template with what is seen, for a new thing
  double least_correlation = 0.35;  // of its patch with the best of the template's, for a new thing
  double max_gap_m = 0.012;         // between the lines of sight of both eyes to a new thing's centre
  double min_distance_m = 0.12;     // from the eyes
  double max_distance_m = 0.90;
  int frames_to_confirm = 3;     // pictures in which a new thing is seen before it is believed
  double memory_s = 3.0;         // a thing that is not seen keeps its identity for this long
  double whole_fraction = 0.94;  // of the expected outline: less may be called occluded
  double whole_overlap = 0.965;  // a thing that fits so well is seen whole
  double still_gain = 0.20;      // share of a new view in the position of a thing at rest
  double moving_gain = 0.80;     // and of one that moves
  double moving_m = 0.010;       // a view this far from the filtered place means that it moves
};

// A pair of pictures, reduced to what the tracker needs.
struct StereoBlobs {
  Time stamp;
  EyePair eyes;
  const Image* images[2] = {nullptr, nullptr};
  const std::vector<Blob>* blobs[2] = {nullptr, nullptr};
  bool eyes_fast = false;  // the eyes turn so fast that no new thing should be believed
};

// Finds the things of a template set in pairs of pictures, tells apart those of one colour by shape and look,
// and keeps their identity, place and turn over time and partial occlusion. One thread.
class ObjectTracker {
 public:
  ObjectTracker(const TemplateSet& templates, TrackerSettings settings);

  // The things that are seen in this pair, best first.
  const std::vector<SeenObject>& step(const StereoBlobs& input);
  // Where a thing was seen last, if it is remembered; age in s.
  struct Memory {
    Eigen::Vector3d p_Root_m;
    double age_s;
    double confidence;
  };
  [[nodiscard]] std::optional<Memory> remember(const std::string& name, Time now) const;

 private:
  struct Track {
    std::size_t object = 0;     // index of the template
    std::vector<double> score;  // per template: running mean of how well it explains this thing
    Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();
    double yaw_rad = 0;
    Eigen::Matrix3d tilt = Eigen::Matrix3d::Identity();
    double confidence = 0;
    int views = 0;   // whole views so far
    int poor = 0;    // views one after the other that it does not explain well
    int doubts = 0;  // of these, looks in which another thing of its colour did
    Time seen;
    bool seen_now = false;
    bool occluded = false;
    std::array<std::array<double, 4>, 2> box{};
    [[nodiscard]] Fit pose() const { return {p_Root_m, yaw_rad, 0, tilt}; }
  };
  // What the blobs that a track claims look like together.
  struct Claim {
    OutlinePair outlines;
    std::array<std::array<double, 4>, 2> box{};
    std::array<int, 2> biggest{-1, -1};
    int area_px = 0;
  };

  std::optional<Claim> claim(const Track& track, const StereoBlobs& input);
  void update(Track& track, const Claim& claim, const StereoBlobs& input);
  void judge_shape(Track& track, const Claim& claim, const StereoBlobs& input, bool search_yaw);
  bool is_replaced(Track& track, const Claim& claim, const StereoBlobs& input);
  void find_new(const StereoBlobs& input);
  void find_in_pieces(int colour, double least_overlap, const StereoBlobs& input);
  bool take_up(const Claim& seen, const Eigen::Vector3d& p_Root_m, int colour, bool in_pieces,
               double least_overlap, const StereoBlobs& input);
  [[nodiscard]] bool in_reach_of_eyes(const Eigen::Vector3d& p_Root_m, const StereoBlobs& input) const;
  [[nodiscard]] double look(std::size_t object, const StereoBlobs& input,
                            const std::array<int, 2>& blobs) const;

  TemplateSet templates_;
  TrackerSettings settings_;
  ColourTable table_;
  std::vector<std::vector<std::size_t>> objects_of_colour_;
  std::vector<Track> tracks_;
  std::array<std::vector<bool>, 2> taken_;
  std::vector<SeenObject> seen_;
};

}  // namespace nido::vision
