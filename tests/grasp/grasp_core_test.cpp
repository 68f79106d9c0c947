#include "nido/grasp/grasp_core.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "nido/grasp/policies.h"

namespace nido::grasp {
namespace {

constexpr double kTick_s = 0.01;

GraspOptions options() {
  GraspOptions o;
  o.limits.spread_upper_rad = 1.0;
  for (std::size_t i = 0; i < kFingerCount; ++i) {
    o.limits.lower_rad[i] = 0;
    o.limits.upper_rad[i] = i == 7 ? 4.7 : 1.57;
  }
  FingerPosture open;
  open.spread_rad = 0.3;
  open.joint_rad[0] = 1.2;
  o.preshape["cube"] = open;
  return o;
}

// Fingers that follow their targets until something of a given thickness stops them; a pad feels it then.
class HandWorld {
 public:
  explicit HandWorld(double stop_share) : stop_share_(stop_share) {}
  void follow(const FingerPosture& target, const GraspOptions& o) {
    measured.spread_rad = target.spread_rad;
    touch.fill(false);
    for (std::size_t i = 0; i < kFingerCount; ++i) {
      const double stop = i == 0 ? o.limits.upper_rad[i] : stop_share_ * o.limits.upper_rad[i];
      measured.joint_rad[i] = std::min(target.joint_rad[i], stop);
      if (i > 0 && target.joint_rad[i] > stop) {
        for (const int pad : kPadOfFinger[i]) {
          if (pad >= 0) touch[static_cast<std::size_t>(pad)] = true;
        }
      }
    }
  }
  FingerPosture measured;
  std::array<bool, kPadCount> touch{};

 private:
  double stop_share_;
};

Eigen::VectorXd all_closed(const Eigen::VectorXd&, bool) { return Eigen::VectorXd::Ones(kFingerCount); }

// runs until the goal ends; returns its last status
GraspStatus perform(GraspCore& core, HandWorld& hand, const GraspOptions& o, const GraspGoal& goal) {
  GraspInputs inputs;
  inputs.goal = goal;
  GraspStatus last;
  for (int tick = 0; tick < 1000; ++tick) {
    inputs.measured = hand.measured;
    inputs.touch = hand.touch;
    const GraspOutputs out = core.step(kTick_s, inputs);
    inputs.goal.reset();
    hand.follow(out.target, o);
    if (out.status) last = *out.status;
    if (last.state == "done" || last.state == "failed") break;
  }
  return last;
}

TEST(GraspCore, ClosesOnAnObjectAndHoldsIt) {
  const GraspOptions o = options();
  GraspCore core(o, all_closed);
  HandWorld hand(0.5);
  EXPECT_EQ(perform(core, hand, o, {1, "open", "blue cube"}).state, "done");
  EXPECT_EQ(perform(core, hand, o, {2, "grasp", "blue cube"}).state, "done");
  EXPECT_TRUE(core.holding());
}

TEST(GraspCore, EmptyHandFailsWithASentence) {
  const GraspOptions o = options();
  GraspCore core(o, all_closed);
  HandWorld hand(1.0);
  const GraspStatus status = perform(core, hand, o, {3, "grasp", "blue cube"});
  EXPECT_EQ(status.state, "failed");
  EXPECT_NE(status.reason.find("no object"), std::string::npos);
  EXPECT_FALSE(core.holding());
}

TEST(GraspCore, NoticesThatTheObjectSlipped) {
  const GraspOptions o = options();
  GraspCore core(o, all_closed);
  HandWorld hand(0.5);
  ASSERT_EQ(perform(core, hand, o, {4, "grasp", "blue cube"}).state, "done");
  HandWorld empty(1.0);
  empty.measured = hand.measured;
  GraspStatus last;
  for (int tick = 0; tick < 300 && last.state != "failed"; ++tick) {
    GraspInputs inputs;
    inputs.measured = empty.measured;
    inputs.touch = empty.touch;
    const GraspOutputs out = core.step(kTick_s, inputs);
    empty.follow(out.target, o);
    if (out.status) last = *out.status;
  }
  EXPECT_EQ(last.state, "failed");
  EXPECT_NE(last.reason.find("slipped"), std::string::npos);
}

TEST(GraspCore, ReleaseOpensToTheRestPosture) {
  const GraspOptions o = options();
  GraspCore core(o, all_closed);
  HandWorld hand(0.5);
  ASSERT_EQ(perform(core, hand, o, {5, "grasp", "blue cube"}).state, "done");
  EXPECT_EQ(perform(core, hand, o, {6, "release", "blue cube"}).state, "done");
  EXPECT_NEAR(hand.measured.joint_rad[3], 0.0, 0.1);
  EXPECT_FALSE(core.holding());
}

// a bent thumb that swings back wedges things against the palm: it waits until the fingers are straight
TEST(GraspCore, ReleaseStretchesTheFingersBeforeTheThumbSwingsBack) {
  const GraspOptions o = options();
  GraspCore core(o, all_closed);
  HandWorld hand(0.5);
  ASSERT_EQ(perform(core, hand, o, {1, "open", "blue cube"}).state, "done");
  ASSERT_EQ(perform(core, hand, o, {2, "grasp", "blue cube"}).state, "done");
  const double opposed_rad = hand.measured.joint_rad[0];
  GraspInputs inputs;
  inputs.goal = GraspGoal{3, "release", "blue cube"};
  bool swung_back = false;
  for (int tick = 0; tick < 1000 && !swung_back; ++tick) {
    inputs.measured = hand.measured;
    inputs.touch = hand.touch;
    const GraspOutputs out = core.step(kTick_s, inputs);
    inputs.goal.reset();
    hand.follow(out.target, o);
    swung_back = out.target.joint_rad[0] < opposed_rad - 0.1;
    if (!swung_back) continue;
    for (std::size_t i = 1; i < kFingerCount; ++i)
      EXPECT_LT(hand.measured.joint_rad[i], 0.3) << kFingerName[i];
  }
  EXPECT_TRUE(swung_back);
}

// the squeeze of a stalled finger is bounded and no target ever leaves its limits, whatever the policy says
TEST(GraspCore, TargetsStayWithinLimitsAndLead) {
  const GraspOptions o = options();
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> wild(-2.0, 3.0);
  GraspCore core(o, [&](const Eigen::VectorXd&, bool) {
    Eigen::VectorXd y(kFingerCount);
    for (auto& v : y) v = wild(random);
    return y;
  });
  HandWorld hand(0.4);
  GraspInputs inputs;
  inputs.goal = GraspGoal{7, "grasp", "red ball"};
  for (int tick = 0; tick < 500; ++tick) {
    inputs.measured = hand.measured;
    inputs.touch = hand.touch;
    const GraspOutputs out = core.step(kTick_s, inputs);
    inputs.goal.reset();
    for (std::size_t i = 0; i < kFingerCount; ++i) {
      EXPECT_GE(out.target.joint_rad[i], o.limits.lower_rad[i]);
      EXPECT_LE(out.target.joint_rad[i], o.limits.upper_rad[i]);
      const double most = o.lead_rad * std::max(1.0, o.limits.upper_rad[i] / (M_PI / 2));
      EXPECT_LE(out.target.joint_rad[i] - hand.measured.joint_rad[i], most + 1e-9);
    }
    hand.follow(out.target, o);
  }
}

// a bandit in the shape of a grasp: only closed fingers are rewarded
TEST(GraspLearner, LearnsToCloseTheHandFromRewardAlone) {
  int learned = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    GraspLearner learner({}, seed);
    const auto policy = learner.policy();
    double last_reward = 0;
    for (int attempt = 0; attempt < 40; ++attempt) {
      double mean = 0;
      for (int step = 0; step < 3; ++step) {
        mean += policy(Eigen::VectorXd::Zero(kPadCount), step == 0).tail(7).mean() / 3;
      }
      last_reward = std::clamp((mean - 0.5) / 0.3, 0.0, 1.0);
      learner.reward(last_reward);
    }
    learned += last_reward > 0.9 ? 1 : 0;
  }
  EXPECT_GE(learned, 8);
}

}  // namespace
}  // namespace nido::grasp
