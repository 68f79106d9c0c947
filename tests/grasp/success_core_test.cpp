#include "success_core.h"

#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace nido::grasp {
namespace {

constexpr double kTick_s = 0.01;

TEST(DrawThing, IsOneOfEachKindWithinReachAndTheSameForTheSameSeed) {
  std::set<std::string> shapes;
  for (int number = 0; number < 200; ++number) {
    const SuccessThing thing = draw_thing(7, number);
    shapes.insert(thing.shape);
    EXPECT_EQ(thing.p_Root_m, draw_thing(7, number).p_Root_m);
    EXPECT_NE(thing.p_Root_m, draw_thing(8, number).p_Root_m);
    EXPECT_EQ(thing.p_Root_m.y(), -draw_thing(7, number, "left").p_Root_m.y());
    EXPECT_GE(thing.p_Root_m.x(), -0.38);
    EXPECT_LE(thing.p_Root_m.y(), 0.12);
    EXPECT_FALSE(thing.phrases.empty());
    if (thing.shape == "bear") continue;
    EXPECT_GE(thing.width_m, 0.025);
    EXPECT_LE(thing.width_m, 0.06);
  }
  EXPECT_EQ(shapes, (std::set<std::string>{"ball", "bear", "box", "cylinder"}));
}

// Answers what the experimenter asks; the story of the robot is written by the test.
class Bench {
 public:
  explicit Bench(int first) : core_(SuccessOptions{.seed = 1, .first = first, .count = 1}) {
    // cleared, the thing put down, the phrase said
    for (int tick = 0; tick < 1000 && said_.empty(); ++tick) step({});
  }
  void step(const std::vector<SuccessInputs::Stage>& stages) {
    in_.stages = stages;
    if (core_.wants_height()) in_.above_rest_m = above_m_;
    const SuccessOutputs out = core_.step(kTick_s, in_);
    in_ = {};
    if (out.reach) in_.reach = SuccessInputs::Done{out.reach->id, true};
    if (out.grasp) in_.grasp = SuccessInputs::Done{out.grasp->id, true};
    if (out.say) said_.push_back(*out.say);
    if (out.result) result_ = out.result;
    finished_ = finished_ || out.finished;
  }
  void hold(double above_m, double for_s) {
    above_m_ = above_m;
    for (int tick = 0; tick < for_s / kTick_s; ++tick) step({});
  }
  std::vector<std::string> said_;
  std::optional<SuccessResult> result_;
  bool finished_ = false;

 private:
  SuccessCore core_;
  SuccessInputs in_;
  double above_m_ = 0;
};

TEST(SuccessCore, EyesHaveTimeToForgetTheLastThingBeforeTheNext) {
  SuccessCore core(SuccessOptions{.seed = 1, .first = 0, .count = 2});
  SuccessInputs in;
  std::optional<int> removed;
  int pause = 0;
  for (int tick = 0; tick < 2000; ++tick) {
    const SuccessOutputs out = core.step(kTick_s, in);
    in = {};
    if (out.reach) in.reach = SuccessInputs::Done{out.reach->id, true};
    if (out.grasp) in.grasp = SuccessInputs::Done{out.grasp->id, true};
    if (out.say) in.stages = {{"idle", "failed", ""}};
    if (out.remove) removed = tick;
    if (out.put) pause = tick - removed.value_or(tick);
  }
  EXPECT_GE(pause * kTick_s, 3.5);
}

TEST(SuccessCore, ThreeSecondsInTheAirAreASuccess) {
  Bench bench(0);
  ASSERT_EQ(bench.said_, std::vector<std::string>{"grasp blue cube"});
  bench.step({{"grasped", "begin", ""}});
  bench.step({{"grasped", "done", ""}});
  bench.hold(0.12, 4.0);
  bench.step({{"idle", "done", "Done: I hold the blue cube."}});
  ASSERT_TRUE(bench.result_);
  EXPECT_TRUE(bench.result_->success);
  EXPECT_TRUE(bench.result_->said_so);
  EXPECT_EQ(bench.result_->closings, 1);
  for (int tick = 0; tick < 10; ++tick) bench.step({});
  EXPECT_TRUE(bench.finished_);
}

TEST(SuccessCore, AThingThatComesDownIsNoSuccessWhateverTheRobotSays) {
  Bench bench(0);
  bench.step({{"grasped", "begin", ""}});
  bench.step({{"grasped", "done", ""}});
  bench.hold(0.12, 2.0);
  bench.hold(0.0, 0.2);
  bench.hold(0.12, 4.0);  // not taken up by anybody: it must not count again
  bench.step({{"idle", "done", ""}});
  ASSERT_TRUE(bench.result_);
  EXPECT_FALSE(bench.result_->success);
  EXPECT_NEAR(bench.result_->held_s, 2.0, 0.11);
}

TEST(SuccessCore, ASecondTryCountsFromItsOwnLift) {
  Bench bench(1);
  bench.step({{"grasped", "begin", ""}});
  bench.step({{"grasped", "done", ""}});
  bench.hold(0.12, 1.0);
  bench.step({{"grasped", "failed",
               "I lost the blue ball: the object slipped out of the hand. I try again (2 of 3)."}});
  bench.step({{"grasped", "begin", ""}});
  bench.step({{"grasped", "done", ""}});
  bench.hold(0.12, 3.5);
  bench.step({{"idle", "done", ""}});
  ASSERT_TRUE(bench.result_);
  EXPECT_TRUE(bench.result_->success);
  EXPECT_EQ(bench.result_->closings, 2);
  EXPECT_EQ(bench.result_->slips_noticed, 1);
}

TEST(SuccessCore, ATinIsNamedAnotherWayWhenTheRobotDoesNotFindIt) {
  Bench bench(3);
  ASSERT_EQ(bench.said_, std::vector<std::string>{"grasp blue ball"});
  bench.step({{"seen", "failed", ""}, {"idle", "failed", ""}});
  EXPECT_FALSE(bench.result_);
  ASSERT_EQ(bench.said_.size(), 2U);
  EXPECT_EQ(bench.said_[1], "grasp blue cube");
  bench.step({{"seen", "failed", ""}, {"idle", "failed", "I do not find it."}});
  ASSERT_TRUE(bench.result_);
  EXPECT_FALSE(bench.result_->success);
}

}  // namespace
}  // namespace nido::grasp
