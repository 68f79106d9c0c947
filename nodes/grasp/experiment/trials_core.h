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
  std::string trouble;        // why it could not be tried: the arm did not get there; then there is no reward
  bool closed_on_it = false;  // the hand felt something
  int steps_held = 0;         // time steps of 10 ms that the object stayed up, at most the test's length
  double reward = 0;          // steps_held / length of the test
};

struct TrialOptions {
  int attempts = 15;       // the paper's number
  bool until_max = false;  // no further attempt after the first whole reward
  int test_steps = 250;    // longest hold that counts, 10 ms each (the paper's number)
  // What pulls at the object during the test, N: it grows from nothing to this at the test's end, and its
  // direction changes ten times. 0: gravity alone.
  double pull_N = 0;
  double up_m = 0.04;  // an object this far above its place is in the hand
  double lift_m = 0.08;
  std::vector<std::string> objects = {"blue cube"};  // in turn
  Eigen::Vector2d p_Root_m{-0.28, 0.08};             // where the hand goes, root frame
  double spread_m = 0.02;                            // at random around it, by seed
  double off_m = 0.006;    // so far from where the hand expects it, in x and in y, an object may be put
  double turn_rad = 0.35;  // and so far turned
  Eigen::Vector2d p_aside_Root_m{-0.50, -0.28};  // objects wait from here on, along y
  double stage_timeout_s = 20;                   // an action that takes longer counts as failed
};

// What the experimenter does in one tick.
struct TrialOutputs {
  struct Action {
    std::uint32_t id = 0;
    std::string action;
    std::string object;
    Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();
  };
  struct Put {
    std::string object;
    Eigen::Vector2d p_Root_m = Eigen::Vector2d::Zero();  // on the table, at rest
    double yaw_rad = 0;
  };
  struct Pull {
    std::string object;
    Eigen::Vector3d f_Root_N = Eigen::Vector3d::Zero();
    double duration_s = 0;
  };
  std::optional<Action> reach;
  std::optional<Action> grasp;
  std::optional<Put> put;
  std::optional<Pull> pull;
  std::optional<TrialResult> result;  // of the attempt that just ended; its reward goes to the learner
  bool finished = false;
};

struct TrialInputs {
  struct Done {
    std::uint32_t id = 0;
    std::string state;  // "running", "done", "failed"
    std::string reason;
  };
  std::optional<Done> reach;
  std::optional<Done> grasp;
  double object_height_m = 0;   // of its middle, root frame; looked at while wants_height()
  bool borne_by_other = false;  // table or another thing touches it; likewise
};

// The experimenter of the grasping experiment: has the open hand brought to a place over the table, puts the
// object under it, has the hand closed and lifted, lets gravity and a pull test the grasp, gives the reward.
// Knows the truth of the world; the learner gets touch and reward only. Not thread-safe; step() once a tick
// of 10 ms.
class TrialsCore {
 public:
  // `rest_height_m`: of the middle of each of the objects when it lies on the table, root frame.
  TrialsCore(TrialOptions options, std::vector<double> rest_height_m, std::uint64_t seed);
  TrialOutputs step(double dt_s, const TrialInputs& inputs);
  [[nodiscard]] bool wants_height() const { return stage_ == Stage::kHold; }
  // Of the present attempt.
  [[nodiscard]] const std::string& object() const { return options_.objects[which_]; }

 private:
  enum class Stage { kHome, kAside, kApproach, kPut, kClose, kLift, kHold, kRelease };
  void enter(Stage stage, TrialOutputs& out);
  void end_attempt(TrialOutputs& out);
  [[nodiscard]] std::optional<TrialOutputs::Pull> pull() const;
  [[nodiscard]] bool ended(const std::optional<TrialInputs::Done>& status, bool& well);
  [[nodiscard]] TrialOutputs::Action action(const std::string& name) const;

  TrialOptions options_;
  std::vector<double> rest_height_m_;
  std::mt19937_64 random_;
  Stage stage_ = Stage::kHome;
  bool begun_ = false;
  bool hand_open_ = false;
  bool hand_there_ = false;
  std::size_t which_ = 0;
  std::uint32_t id_ = 0;
  double in_stage_s_ = 0;
  std::string reason_;  // of the last failed action
  Eigen::Vector2d p_Root_m_ = Eigen::Vector2d::Zero();
  TrialResult result_;
};

}  // namespace nido::grasp
