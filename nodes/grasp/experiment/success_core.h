#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace nido::grasp {

// A thing to be grasped, drawn by number and seed. Root frame, m, rad.
struct SuccessThing {
  std::string shape;     // "box", "ball", "cylinder", "bear"
  bool trained = false;  // the network learned with a thing of this shape and size
  double width_m = 0;    // edge or diameter
  double height_m = 0;
  Eigen::Vector2d p_Root_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0;
  // What the robot is told, in turn until it finds what was named: nobody knows as what it sees a small box.
  std::vector<std::string> phrases;
};

// Sizes of the unseen things, m: edges of boxes; diameters and heights of cylinders. The eyes know these
// bodies, the fingers do not.
const std::vector<double>& unseen_boxes_m();
const std::vector<std::array<double, 2>>& unseen_cylinders_m();

// The number-th thing of a seed: cube of 5 cm, ball of 6 cm, boxes from 2.5 to 6 cm, cylinders, bear, in
// turn; anywhere where the hand takes things, turned any way: the same for both hands, in the mirror.
SuccessThing draw_thing(std::uint64_t seed, int number, const std::string& hand = "right");

// What became of it.
struct SuccessResult {
  int number = 0;  // from 0
  SuccessThing thing;
  bool success = false;   // stayed in the hand for the whole test
  double held_s = 0;      // after the robot said that it holds it
  int closings = 0;       // tries
  int slips_noticed = 0;  // times that it said that it lost the thing
  bool said_so = false;   // its own last word
  std::string sentence;   // the robot's last
};

struct SuccessOptions {
  std::uint64_t seed = 1;
  std::string hand = "right";
  int first = 0;  // number of the first thing
  int count = 10;
  double test_s = 3.0;         // to be held after lifting
  double up_m = 0.04;          // a thing this far above its place is in the air
  double look_period_s = 0.1;  // of wants_height()
  double job_limit_s = 200;    // the robot's own limits end it sooner
  double clear_limit_s = 20;   // hand opened and home
};

struct SuccessInputs {
  struct Done {
    std::uint32_t id = 0;
    bool ended = false;  // done or failed
  };
  struct Stage {
    std::string stage;
    std::string state;
    std::string text;
  };
  std::optional<Done> reach;
  std::optional<Done> grasp;
  std::vector<Stage> stages;           // what the robot tells of itself
  std::optional<double> above_rest_m;  // the thing's middle over where it was put, when it was looked at
};

struct SuccessOutputs {
  struct Action {
    std::uint32_t id = 0;
    std::string action;
  };
  std::optional<Action> reach;  // to clear up
  std::optional<Action> grasp;
  bool remove = false;              // take the last thing away
  std::optional<SuccessThing> put;  // put this on the table
  std::optional<std::string> say;   // to the robot
  std::optional<SuccessResult> result;
  bool finished = false;
};

// The experimenter of grasp-success: puts one thing after the other on the table, tells the robot to grasp
// it, and looks how long it stays in the air. The robot sees, reaches, grasps and tries again by itself. Not
// thread-safe; step() once a tick.
class SuccessCore {
 public:
  explicit SuccessCore(const SuccessOptions& options) : options_(options), number_(options.first) {}
  SuccessOutputs step(double dt_s, const SuccessInputs& inputs);
  // Shall above_rest_m be given in the next step?
  [[nodiscard]] bool wants_height() const { return watching_ && since_look_s_ >= options_.look_period_s; }

 private:
  enum class State { kClear, kSettle, kJob, kFinished };
  void clear(SuccessOutputs& out);
  void tell(SuccessOutputs& out);
  void follow_job(double dt_s, const SuccessInputs& inputs, SuccessOutputs& out);

  SuccessOptions options_;
  State state_ = State::kClear;
  bool begun_ = false;
  int number_ = 0;
  std::uint32_t id_ = 1'000'000'000;  // far from those of the robot's own goals
  bool open_ = false;
  bool home_ = false;
  double in_state_s_ = 0;
  double since_look_s_ = 0;
  bool watching_ = false;
  bool dropped_ = false;
  std::size_t phrase_ = 0;
  SuccessResult result_;
};

}  // namespace nido::grasp
