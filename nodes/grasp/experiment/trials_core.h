#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace nido::grasp {

// One attempt and what came of it.
struct TrialResult {
  int attempt = 0;  // from 1
  std::string object;
  bool closed_on_it = false;  // the hand felt something
  int steps_held = 0;         // time steps of 10 ms that the object stayed up, at most the test's length
  double reward = 0;          // steps_held / length of the test
};

struct TrialOptions {
  int attempts = 15;     // the paper's number
  int test_steps = 250;  // longest hold that counts, 10 ms each (the paper's number)
  double up_m = 0.04;    // an object this far above its place is in the hand
  std::string object = "blue cube";
  Eigen::Vector3d p_Root_m{-0.28, 0.08, -0.0576};  // where it is put, root frame
  double spread_m = 0.02;                          // at random around it, by seed
  double stage_timeout_s = 20;                     // an action that takes longer counts as failed
};

// What the experimenter does in one tick.
struct TrialOutputs {
  struct Action {
    std::uint32_t id = 0;
    std::string action;
  };
  std::optional<Action> reach;  // goals; position() is where the object was put
  std::optional<Action> grasp;
  std::optional<Eigen::Vector3d> put_object_Root_m;  // put it here now, at rest
  std::optional<TrialResult> result;  // of the attempt that just ended; its reward goes to the learner
  bool finished = false;
};

struct TrialInputs {
  struct Done {
    std::uint32_t id = 0;
    std::string state;  // "running", "done", "failed"
  };
  std::optional<Done> reach;
  std::optional<Done> grasp;
  double object_height_m = 0;  // of its centre, root frame
};

// The experimenter of the grasping experiment: puts the object before the robot, has the hand brought to it,
// closed and lifted, lets gravity test the grasp, gives the reward. Knows the truth of the world; the learner
// gets touch and reward only. Not thread-safe; step() once a tick of 10 ms.
class TrialsCore {
 public:
  TrialsCore(TrialOptions options, std::uint64_t seed);
  TrialOutputs step(double dt_s, const TrialInputs& inputs);
  [[nodiscard]] const Eigen::Vector3d& p_Root_m() const { return p_Root_m_; }

 private:
  enum class Stage { kHome, kPut, kOpen, kApproach, kClose, kLift, kHold, kRelease };
  void enter(Stage stage, TrialOutputs& out);
  [[nodiscard]] bool ended(const std::optional<TrialInputs::Done>& status, bool& well) const;

  TrialOptions options_;
  std::mt19937_64 random_;
  Stage stage_ = Stage::kHome;
  bool begun_ = false;
  std::uint32_t id_ = 0;
  double in_stage_s_ = 0;
  Eigen::Vector3d p_Root_m_ = Eigen::Vector3d::Zero();
  TrialResult result_;
};

}  // namespace nido::grasp
