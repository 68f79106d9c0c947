#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nido/grasp/fingers.h"

namespace nido::grasp {

// What is asked of the hand.
struct GraspGoal {
  std::uint32_t id = 0;
  std::string action;  // "open" (pre-shape for the object), "grasp", "release", "stop"
  std::string object;  // "blue cube"; its last word is the shape
};

// What the hand feels at one tick.
struct GraspInputs {
  std::optional<GraspGoal> goal;        // a new one
  std::array<bool, kPadCount> touch{};  // pads
  FingerPosture measured;               // encoders
};

// How a goal stands.
struct GraspStatus {
  std::uint32_t id = 0;
  std::string action;
  std::string state;   // "running", "done", "failed"
  std::string reason;  // a sentence, when failed
};

struct GraspOutputs {
  FingerPosture target;               // to be streamed as position-direct command
  bool active = false;                // false: nothing was asked yet, send no command
  std::optional<GraspStatus> status;  // when it changed, and now and then while running
  double opening_rad = 0;  // how far the closed fingers stand from where they would be without an object
};

struct GraspOptions {
  FingerLimits limits;
  std::map<std::string, FingerPosture> preshape;  // by shape: "cube", "ball", "bear"; "" for all others
  FingerPosture rest;                             // of an empty hand that does nothing
  double decision_period_s = 0.5;                 // the network is asked so often
  int decisions = 3;                              // of one closing; then the grasp is judged
  double speed_rad_s = 1.2;  // of proximal joints; distal joints move in proportion to their range
  double lead_rad =
      0.5;  // a target leads its joint by no more than this: bounds the squeeze of a stalled finger
  double touch_lead_rad = 0.35;  // the same once the finger's own pad feels something
  double lost_after_s = 0.5;     // holding with no pad on and no finger held open: the object is lost
};

// The grasping process without its ports: closes the fingers as a policy (the Jordan network) says from touch
// and its own outputs, stops fingers that feel something, keeps squeezing, and knows from touch and joint
// angles alone whether it holds anything. Not thread-safe; call step() once a tick.
class GraspCore {
 public:
  // Asks for finger positions, 0 (open) to 1 (closed), from the six pads (0 or 1). `first` marks the start of
  // a closing.
  using Policy = std::function<Eigen::VectorXd(const Eigen::VectorXd& touch, bool first)>;

  GraspCore(GraspOptions options, Policy policy);

  // `dt_s`: time since the last call.
  GraspOutputs step(double dt_s, const GraspInputs& inputs);

  // True from the end of a successful closing until release or loss.
  [[nodiscard]] bool holding() const { return phase_ == Phase::kHolding; }

 private:
  enum class Phase { kIdle, kMoving, kStretching, kClosing, kHolding };
  void start(const GraspGoal& goal, const GraspInputs& inputs);
  void move_towards(const FingerPosture& goal, double dt_s);
  void close_step(double dt_s, const GraspInputs& inputs);
  void bound_lead(const GraspInputs& inputs);
  [[nodiscard]] double opening_rad(const GraspInputs& inputs) const;
  [[nodiscard]] bool feels_object(const GraspInputs& inputs) const;
  [[nodiscard]] bool reached(const FingerPosture& goal, const GraspInputs& inputs) const;
  [[nodiscard]] const FingerPosture& preshape_of(const std::string& object) const;
  GraspStatus status(const std::string& state, const std::string& reason = {}) const;

  GraspOptions options_;
  Policy policy_;
  Phase phase_ = Phase::kIdle;
  GraspGoal goal_;
  FingerPosture target_;     // streamed
  FingerPosture move_goal_;  // of "open" and "release"
  Eigen::VectorXd desired_;  // the policy's last answer, 0..1
  bool active_ = false;
  int decisions_made_ = 0;
  double since_decision_s_ = 0;
  double elapsed_s_ = 0;
  double nothing_felt_s_ = 0;
};

}  // namespace nido::grasp
