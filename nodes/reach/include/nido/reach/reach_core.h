#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/reach/correction_memory.h"
#include "nido/reach/motion_planner.h"
#include "nido/reach/posture_history.h"

namespace nido::reach {

// What reach is asked to do (nido_msgs/ActionGoal).
struct ReachGoal {
  std::uint32_t id = 0;
  // "reach", "pregrasp", "lift", "carry", "point", "home", "stop", "correct", "yield"
  std::string action;
  // "blue cube"; its last word is the shape. correct: a direction, "left", "right", "up", "down", "forward",
  // "back", "closer" (to the thing); empty: by p_Root_m.
  std::string object;
  // reach, pregrasp: the object's centre. point: where the mark on the hand shall go. lift, carry: where the
  // held object's centre shall go (lift uses the height alone). correct: by how much, if it names no
  // direction.
  Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
};

// The mark on the hand's back as vision saw it, at the time of the image.
struct HandSighting {
  double time_s = 0.0;
  Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();
  double confidence = 0.0;
};

// What has arrived since the last tick.
struct ReachInput {
  std::optional<Joints> measured_rad;  // encoders
  std::optional<HandSighting> hand;
  std::optional<std::vector<SeenObject>> objects;
  std::optional<ReachGoal> goal;
};

enum class ActionState { kIdle, kRunning, kDone, kFailed };

struct ReachStatus {
  std::uint32_t id = 0;
  std::string action;
  ActionState state = ActionState::kIdle;
  std::string reason;    // a sentence, when failed
  double error_m = 0.0;  // of the hand, by encoders, learned model and eyes, from the present goal
  bool operator==(const ReachStatus&) const = default;
};

struct ReachOutput {
  std::optional<Joints> command_rad;  // position-direct targets of this tick; nothing before the first goal
  ReachStatus status;
  std::optional<std::string> note;  // something worth a line of the log
  bool corrected = false;           // something was learned from a correction in this tick
};

struct ReachOptions {
  std::map<std::string, PalmPosture> grasp_postures;  // by shape; "" for shapes that are not named
  PalmPosture reach_posture;                          // over a thing, without touching it
  bool paper_network_alone = false;  // point: the posture that the paper's network gives, nothing else
  double approach_speed_m_s = 0.06;
  double lift_speed_m_s = 0.08;
  double lift_height_m = 0.12;  // when the goal's position says nothing about it
  double carry_speed_m_s = 0.12;
  double look_s = 0.6;        // how long to wait for sightings of the resting hand before the last approach
  double settle_s = 0.8;      // longest wait for the joints to arrive
  double arrived_rad = 0.01;  // joints nearer to their target count as arrived
  double blocked_rad = 0.3;   // a joint so far behind its target for blocked_s ends the action
  double blocked_s = 0.5;
  double sighting_gain = 0.25;
  double most_visual_offset_m = 0.06;
  double most_innovation_m = 0.04;   // sightings farther from the prediction are not believed at first
  double most_change_m = 0.08;       // ever: what is seen farther off is not the hand
  int sightings_to_notice = 8;       // but so many that agree are: the body or the eyes have changed
  double refine_m = 0.004;           // seen farther off its goal than this, the resting hand goes there again
  int refinements = 2;               // at most so often
  double correction_step_m = 0.015;  // "a bit"
  double corrected_from_m = 0.05;    // the hand must be so near to where it was brought
  double led_m = 0.008;              // the hand that was moved so far and then rests was led there
  double led_rest_s = 0.7;
  double give_way_rad = 0.002;  // while it is led, a joint's target stays so near to the joint
  double yield_s = 20.0;        // for so long it lets itself be led
  double encoders_missing_s = 0.5;
};

// The reaching process without ports: one step a tick of 10 ms. Never blocks; every action ends in bounded
// time. Thread-compatible.
class ReachCore {
 public:
  ReachCore(MotionPlanner planner, ReachOptions options);

  // now_s: the node's clock, never going back.
  ReachOutput step(double now_s, const ReachInput& input);

  // Where another arm may move the torso while this one does nothing: the next way begins from where the
  // torso is by then.
  void follow_torso();

  [[nodiscard]] const MotionPlanner& planner() const { return planner_; }
  [[nodiscard]] const Eigen::Vector3d& visual_offset_m() const { return visual_offset_m_; }
  // What people have corrected so far, and what they had before.
  [[nodiscard]] const CorrectionMemory& corrections() const { return corrections_; }
  void set_corrections(CorrectionMemory corrections) { corrections_ = std::move(corrections); }

 private:
  // Follow a path in time.
  struct Move {
    JointPath path;
    PalmGoal goal;
    bool has_goal = false;
  };
  // Wait until the joints have arrived and the eyes had a look at the resting hand.
  struct Look {
    double most_s = 0.0;
    PalmGoal goal;
    int refinements = 0;  // straight ways that may follow if the hand is seen beside its goal
  };
  // Plan a straight way when its turn comes, with what the eyes have said by then.
  struct Straight {
    PalmGoal goal;
    double speed_m_s = 0.0;
    double joint_speed_share = 0.5;
  };
  // Be led: the targets follow the joints until the hand was moved and rests.
  struct Yield {
    std::optional<Joints> start;
    Joints resting = Joints::Zero();  // for how long the joints are where they are
    double resting_since_s = 0.0;
  };
  using Stage = std::variant<Move, Look, Straight, Yield>;

  // What the hand stands at since the last reach or pregrasp, and may be corrected.
  struct Standing {
    std::string action;
    std::string object;
    Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();  // of the thing
    Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  // beside the planned goal
    PalmGoal goal;                                       // with the offset
  };

  void begin(const ReachGoal& goal);
  Status plan(const ReachGoal& goal);
  Status plan_approach(const ReachGoal& goal, const PalmPosture& posture);
  Status plan_point(const ReachGoal& goal);
  Status plan_lift(const ReachGoal& goal);
  Status plan_carry(const ReachGoal& goal);
  Status plan_home();
  Status plan_correction(const ReachGoal& goal);
  Status plan_yield();
  Status learn_correction(const Eigen::Vector3d& change_m);
  // False when it goes on.
  bool yield(Yield& yield, double now_s);
  void run_stages(double now_s);
  void finish(ActionState state, const std::string& reason);
  // Slows the arm down after a motion was broken off; false when it rests.
  bool coast();
  void watch_joints(double now_s, const ReachInput& input);
  void take_sighting(const HandSighting& hand);
  [[nodiscard]] double goal_error_m() const;
  [[nodiscard]] const PalmPosture& grasp_posture(const std::string& object) const;

  MotionPlanner planner_;
  ReachOptions options_;
  ReachStatus status_;
  std::optional<std::string> note_;
  std::optional<ReachGoal> waiting_;  // a goal that came before the first encoders
  double waiting_since_s_ = 0.0;

  std::optional<Joints> measured_;
  double measured_at_s_ = 0.0;
  double behind_since_s_ = 0.0;
  bool is_behind_ = false;
  PostureHistory history_;  // of the encoders, about a second
  std::optional<Joints> command_;
  Joints coast_rad_ = Joints::Zero();  // last change of the command, a tick

  std::deque<Stage> stages_;
  double stage_begin_s_ = 0.0;
  bool stage_begun_ = false;
  int sightings_in_stage_ = 0;
  std::optional<PalmGoal> present_goal_;
  CorrectionMemory corrections_;
  std::optional<Standing> standing_;
  bool corrected_ = false;
  double hand_seen_at_s_ = -10.0;  // at rest or not
  int strange_sightings_ = 0;      // that are not believed but agree, one after the other
  Eigen::Vector3d strange_m_ = Eigen::Vector3d::Zero();

  Eigen::Vector3d visual_offset_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_PalmHeld_m_ =
      Eigen::Vector3d(0.05, 0.0, 0.04);  // middle of the held thing in the palm frame
};

}  // namespace nido::reach
