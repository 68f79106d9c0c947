// nido-attention-trials: the experimenter and judge of attention (docs/attention.md). It puts and moves
// things over the world port, tells the robot once roughly where to look, and compares what the robot's eyes
// do and which pixels it picks with the truth.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "nido/kinematics/robot_model.h"
#include "nido/launcher/paths.h"
#include "nido/middleware/node.h"
#include "nido/middleware/open_port.h"
#include "nido/middleware/stamp.h"
#include "nido/msgs/types.h"
#include "scenes.h"
#include "truth.h"

namespace {

using namespace nido;             // NOLINT(google-build-using-namespace): a program's own file
using namespace nido::attention;  // NOLINT(google-build-using-namespace)

constexpr double kSettle_s = 1.5;   // of a scene: not judged
constexpr double kScene_s = 4.5;    // of which the rest is judged
constexpr double kLate_s = 0.2;     // pictures and segments that were still on their way
constexpr double kPicture_s = 3.5;  // when the report's picture is taken
constexpr double kFloor_Root_m = -0.5976;
constexpr double kCall_s = 20.0;  // wall time: a loaded machine answers late
constexpr double kLost_px = 200;  // error of a centre that is behind the eye

// Encoders at one moment.
struct Joints {
  Time stamp;
  std::vector<double> position_rad;
};
constexpr std::size_t kEncodersKept = 1200;

struct Ports {
  std::unique_ptr<Input<msgs::Image>> left;
  std::unique_ptr<Input<msgs::Image>> segment;
  std::unique_ptr<Input<msgs::Image>> threshold;
  std::unique_ptr<Input<msgs::Percepts>> fixation;
  std::unique_ptr<Input<msgs::JointState>> head;
  std::unique_ptr<Input<msgs::JointState>> torso;
  std::unique_ptr<Output<msgs::GazeGoal>> fixate;
  std::unique_ptr<Output<msgs::StageEvent>> outcome;
};

Status open_ports(Node& node, Ports& ports) {
  if (Status s = open_into(node, ports.left, "/attention_trials/left:i", Profile::kSensor, 64); !s) return s;
  if (Status s = open_into(node, ports.segment, "/attention_trials/segment:i", Profile::kSensor, 64); !s)
    return s;
  if (Status s = open_into(node, ports.threshold, "/attention_trials/threshold:i", Profile::kSensor, 64); !s)
    return s;
  if (Status s = open_into(node, ports.fixation, "/attention_trials/fixation:i", Profile::kState, 64); !s)
    return s;
  if (Status s = open_into(node, ports.head, "/attention_trials/head:i", Profile::kState, 64); !s) return s;
  if (Status s = open_into(node, ports.torso, "/attention_trials/torso:i", Profile::kState, 64); !s) return s;
  if (Status s = open_into(node, ports.fixate, "/attention_trials/fixate:o", Profile::kEvent); !s) return s;
  return open_into(node, ports.outcome, "/attention_trials/outcome:o", Profile::kState);
}

// One pair of pictures with what came of it.
struct Pair {
  std::vector<std::uint8_t> segment;  // empty: no surface
  std::vector<std::uint8_t> threshold;
};

double mean(const std::vector<double>& samples) {
  double sum = 0;
  for (const double s : samples) sum += s;
  return samples.empty() ? 0.0 : sum / static_cast<double>(samples.size());
}

class Trials {
 public:
  Trials(Node& node, Ports& ports, const RobotModel& model, std::uint64_t seed, std::string folder)
      : node_(node), ports_(ports), model_(model), seed_(seed), folder_(std::move(folder)) {}

  Status begin(Time now, int number) {
    scene_ = make_scene(seed_, number);
    begin_ = now;
    path_.clear();
    pairs_.clear();
    picture_.reset();
    seen_ns_.clear();
    for (std::size_t i = 0; i < things().size(); ++i) {
      Placed away{static_cast<int>(i), Eigen::Isometry3d::Identity()};
      away.X_RootThing.translation() << 1.5, -0.5 + 0.1 * static_cast<double>(i), -0.5;
      if (Status put_away = put(away); !put_away) return put_away;
    }
    for (const Placed& other : scene_.others) {
      if (Status there = put(other); !there) return there;
    }
    if (Status there = move(now); !there) return there;
    msgs::GazeGoal goal;
    goal.header(header_at(now, "root"));
    goal.mode("point");
    goal.point().x(scene_.p_RootHint_m.x());
    goal.point().y(scene_.p_RootHint_m.y());
    goal.point().z(scene_.p_RootHint_m.z());
    return ports_.fixate->write(goal);
  }

  [[nodiscard]] double time_s(Time now) const { return Time{now.ns - begin_.ns}.seconds(); }

  // The target goes along its path.
  Status move(Time now) {
    const Placed target{scene_.target.thing, target_at(scene_, time_s(now))};
    path_.emplace_back(now, target);
    if (!scene_.moving && path_.size() > 1) return {};
    return put(target);
  }

  void listen() {
    const auto encoders = [](Input<msgs::JointState>& port, std::deque<Joints>& all) {
      while (auto message = port.take()) {
        all.push_back({time_of(message->header()), message->position()});
        if (all.size() > kEncodersKept) all.pop_front();
      }
    };
    encoders(*ports_.head, head_);
    encoders(*ports_.torso, torso_);
    while (auto message = ports_.segment->take())
      pairs_[time_of(message->header()).ns].segment = message->data();
    while (auto message = ports_.threshold->take())
      pairs_[time_of(message->header()).ns].threshold = message->data();
    while (auto message = ports_.fixation->take()) {
      const Time stamp = time_of(message->header());
      if (stamp.ns >= begin_.ns) seen_ns_.push_back(stamp.ns);
    }
    while (auto message = ports_.left->take()) {
      const Time stamp = time_of(message->header());
      const double at_s = time_s(stamp);
      if (!picture_ && at_s >= kPicture_s) picture_ = std::pair(stamp, std::move(*message));
    }
  }

  // All that was seen of the scene, against the truth.
  Result<nlohmann::json> judge() {
    std::vector<double> fixation_px;
    std::vector<double> overlap;
    std::vector<double> overlap_threshold;
    int lost = 0;
    const PinholeCamera camera;
    for (const std::int64_t ns : seen_ns_) {
      const Time stamp{ns};
      if (time_s(stamp) < kSettle_s || time_s(stamp) > kScene_s) continue;
      const Placed target = target_of(stamp);
      const std::array<Eigen::Isometry3d, 2> X_RootCamera = eyes_at(stamp);
      double off_px = 0;
      for (const auto& X : X_RootCamera) {
        const auto px = camera.project(X.inverse() * target.X_RootThing.translation());
        off_px += (px ? (*px - Eigen::Vector2d(camera.cx_px, camera.cy_px)).norm() : kLost_px) / 2;
      }
      fixation_px.push_back(off_px);
      const auto truth = truth_of(target, X_RootCamera[0]);
      const auto pair = pairs_.find(ns);
      const bool seen = pair != pairs_.end() && pair->second.segment.size() == truth.size();
      lost += seen ? 0 : 1;
      overlap.push_back(seen ? intersection_over_union(pair->second.segment, truth) : 0.0);
      overlap_threshold.push_back(seen ? intersection_over_union(pair->second.threshold, truth) : 0.0);
    }
    if (fixation_px.empty()) {
      return Error{ErrorCode::kFailed, "not one pair of pictures was worked on in scene " +
                                           std::to_string(scene_.number) + "; expected 30 a second"};
    }
    std::string file;
    if (picture_) file = draw();
    return nlohmann::json{{"number", scene_.number},
                          {"moving", scene_.moving},
                          {"clutter", scene_.clutter},
                          {"thing", things()[static_cast<std::size_t>(scene_.target.thing)].name},
                          {"pairs", fixation_px.size()},
                          {"lost", lost},
                          {"fixation_error_px", mean(fixation_px)},
                          {"iou", mean(overlap)},
                          {"iou_threshold", mean(overlap_threshold)},
                          {"picture", file}};
  }

 private:
  Status put(const Placed& placed) {
    const std::string& name = things()[static_cast<std::size_t>(placed.thing)].name;
    const Eigen::Vector3d& p = placed.X_RootThing.translation();
    const Eigen::Vector3d x = placed.X_RootThing.linear().col(0);
    // the world port's frame: x left, y up, z forward, on the floor
    const std::array<std::string, 2> lines = {
        fmt::format("world rot \"{}\" -90 0 {:.5f}", name, 90 + std::atan2(x.y(), x.x()) * 180 / M_PI),
        fmt::format("world set \"{}\" {:.6f} {:.6f} {:.6f}", name, -p.y(), p.z() - kFloor_Root_m,
                    -p.x() - 0.026)};
    for (const std::string& line : lines) {
      auto answer = node_.call("/icubSim/world", line, kCall_s);
      if (!answer) return answer.error();
      if (answer->rfind("[fail]", 0) == 0)
        return Error{ErrorCode::kFailed, "the world answered " + *answer + " to: " + line};
    }
    return {};
  }

  // Where the target was put last before a picture was taken.
  [[nodiscard]] Placed target_of(Time stamp) const {
    Placed placed = path_.front().second;
    for (const auto& [time, there] : path_) {
      if (time.ns < stamp.ns) placed = there;
    }
    return placed;
  }

  [[nodiscard]] static std::vector<double> joints_at(const std::deque<Joints>& all, Time stamp) {
    for (std::size_t i = 1; i < all.size(); ++i) {
      if (all[i].stamp.ns < stamp.ns) continue;
      const auto& a = all[i - 1];
      const auto& b = all[i];
      const double share =
          std::clamp(static_cast<double>(stamp.ns - a.stamp.ns) /
                         static_cast<double>(std::max<std::int64_t>(b.stamp.ns - a.stamp.ns, 1)),
                     0.0, 1.0);
      std::vector<double> joints = a.position_rad;
      for (std::size_t j = 0; j < joints.size(); ++j) joints[j] += share * (b.position_rad[j] - joints[j]);
      return joints;
    }
    return all.empty() ? std::vector<double>{} : all.back().position_rad;
  }

  // The simulated encoders are exact.
  [[nodiscard]] std::array<Eigen::Isometry3d, 2> eyes_at(Time stamp) const {
    Eigen::VectorXd axes = model_.zero_axes();
    const auto fill = [&](const char* part, const std::deque<Joints>& all) {
      const int first = model_.parts()[static_cast<std::size_t>(*model_.part_index(part))].first_axis;
      const auto joints = joints_at(all, stamp);
      for (std::size_t i = 0; i < joints.size(); ++i) axes[first + static_cast<int>(i)] = joints[i];
    };
    fill("head", head_);
    fill("torso", torso_);
    return {model_.X_RootLink(*model_.camera_link("left"), axes),
            model_.X_RootLink(*model_.camera_link("right"), axes)};
  }

  [[nodiscard]] std::vector<std::uint8_t> truth_of(const Placed& target,
                                                   const Eigen::Isometry3d& X_RootCamera) const {
    std::vector<Placed> all = {target};
    all.insert(all.end(), scene_.others.begin(), scene_.others.end());
    return silhouette({}, X_RootCamera, all);
  }

  // The left eye's picture with the segment's outline (magenta) and the true one (white); the file's name.
  std::string draw() {
    auto& [stamp, message] = *picture_;
    const int width = static_cast<int>(message.width());
    const int height = static_cast<int>(message.height());
    if (message.data().size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3)
      return "";
    cv::Mat picture;
    cv::cvtColor(cv::Mat(height, width, CV_8UC3, message.data().data()), picture, cv::COLOR_RGB2BGR);
    cv::resize(picture, picture, {}, 2, 2, cv::INTER_CUBIC);
    const auto outline = [&](std::vector<std::uint8_t> mask, const cv::Scalar& colour) {
      if (mask.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) return;
      cv::Mat large;
      cv::resize(cv::Mat(height, width, CV_8U, mask.data()), large, {}, 2, 2, cv::INTER_NEAREST);
      std::vector<std::vector<cv::Point>> outlines;
      cv::findContours(large, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
      cv::drawContours(picture, outlines, -1, colour, 1);
    };
    outline(truth_of(target_of(stamp), eyes_at(stamp)[0]), {255, 255, 255});
    if (const auto pair = pairs_.find(stamp.ns); pair != pairs_.end())
      outline(pair->second.segment, {255, 0, 255});
    cv::drawMarker(picture, {width, height}, {0, 255, 255}, cv::MARKER_CROSS, 16, 1);
    const std::string file = fmt::format("scene-{:03d}.png", scene_.number);
    try {
      if (cv::imwrite(folder_ + "/" + file, picture)) return file;
    } catch (const cv::Exception&) {
      node_.log_warning("cannot write the picture " + folder_ + "/" + file);
    }
    return "";
  }

  Node& node_;
  Ports& ports_;
  const RobotModel& model_;
  std::uint64_t seed_;
  std::string folder_;
  Scene scene_;
  Time begin_;
  std::vector<std::pair<Time, Placed>> path_;
  std::map<std::int64_t, Pair> pairs_;
  std::vector<std::int64_t> seen_ns_;  // pairs that attention worked on
  std::optional<std::pair<Time, msgs::Image>> picture_;
  std::deque<Joints> head_;
  std::deque<Joints> torso_;
};

Status save(const nlohmann::json& rows, const std::string& path) {
  std::ofstream file(path);
  file << rows.dump(1) << '\n';
  return file ? Status{} : Status{Error{ErrorCode::kFailed, "cannot write " + path}};
}

Status run(Node& node) {
  const auto places = find_places();
  if (!places) return places.error();
  const auto urdf = node.parameter<std::string>("urdf", (places->config / "robots" / "icub.urdf").string());
  if (!urdf) return urdf.error();
  const auto first = node.parameter<int>("first", 0);
  if (!first) return first.error();
  const auto count = node.parameter<int>("count", 4);
  if (!count) return count.error();
  const auto folder = node.parameter<std::string>("folder", ".");
  if (!folder) return folder.error();
  if (*first < 0 || *count < 1) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("parameters first and count are {} and {}; expected 0 or more and 1 or more",
                             *first, *count)};
  }
  const auto model = RobotModel::load(*urdf);
  if (!model) return model.error();
  Ports ports;
  if (Status opened = open_ports(node, ports); !opened) return opened;
  node.set_ready();

  Trials trials(node, ports, *model, node.options().seed, *folder);
  nlohmann::json rows = nlohmann::json::array();
  int number = *first - 1;
  bool playing = false;
  bool finished = false;
  return node.run([&](Time now) -> Status {
    trials.listen();
    if (finished) return {};
    if (playing && trials.time_s(now) > kScene_s + kLate_s) {
      const auto row = trials.judge();
      if (!row) return row.error();
      node.log_info(fmt::format(
          "{} {} {}, {}: {:.1f} px off, overlap {:.2f} (disparity alone {:.2f}), {} lost", number,
          (*row)["moving"].get<bool>() ? "moving" : "static", (*row)["thing"].get<std::string>(),
          (*row)["clutter"].get<bool>() ? "in clutter" : "alone", (*row)["fixation_error_px"].get<double>(),
          (*row)["iou"].get<double>(), (*row)["iou_threshold"].get<double>(), (*row)["lost"].get<int>()));
      rows.push_back(*row);
      if (Status saved = save(rows, *folder + "/attention.json"); !saved) return saved;
      playing = false;
    }
    if (!playing && static_cast<int>(rows.size()) == *count) {
      finished = true;
      msgs::StageEvent end;
      end.header(header_at(now));
      end.stage("outcome");
      end.state("done");
      end.text(fmt::format("{} scenes played", rows.size()));
      return ports.outcome->write(end);
    }
    if (!playing) {
      playing = true;
      return trials.begin(now, ++number);
    }
    return trials.move(now);
  });
}

}  // namespace

int main(int argc, char** argv) { return nido::node_main(argc, argv, "attention_trials", run); }
