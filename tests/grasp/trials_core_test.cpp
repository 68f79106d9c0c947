#include "trials_core.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

namespace nido::grasp {
namespace {

constexpr double kTick_s = 0.01;
constexpr double kRest_m = -0.05;

// A robot that ends every action well after some ticks, unless told otherwise, and whose hand holds for so
// many steps.
struct Robot {
  std::function<int(int attempt)> holds = [](int) { return 1000; };
  std::function<bool(int attempt, const std::string& action)> fails = [](int, const std::string&) {
    return false;
  };

  std::vector<TrialResult> results;
  std::vector<std::string> put;
  std::vector<TrialOutputs::Pull> pulls;
  std::vector<std::string> asked;

  void run(TrialsCore& core) {
    TrialInputs inputs;
    int attempt = 0;
    int looked = 0;
    for (int tick = 0; tick < 200000; ++tick) {
      if (core.wants_height()) inputs.object_height_m = looked++ < holds(attempt) ? kRest_m + 0.08 : kRest_m;
      const TrialOutputs out = core.step(kTick_s, inputs);
      inputs = {};
      const auto answer = [&](const TrialOutputs::Action& action) {
        asked.push_back(action.action);
        if (action.action == "pregrasp") {
          ++attempt;
          looked = 0;
        }
        return TrialInputs::Done{action.id, fails(attempt, action.action) ? "failed" : "done", "because"};
      };
      if (out.reach) inputs.reach = answer(*out.reach);
      if (out.grasp) inputs.grasp = answer(*out.grasp);
      if (out.put) put.push_back(out.put->object);
      if (out.pull) pulls.push_back(*out.pull);
      if (out.result) results.push_back(*out.result);
      if (out.finished) return;
    }
    FAIL() << "never finished";
  }
};

TrialOptions options(int attempts) {
  TrialOptions o;
  o.attempts = attempts;
  return o;
}

TEST(TrialsCore, RewardIsTheShareOfTheTestThatTheObjectStayedUp) {
  TrialsCore core(options(3), {kRest_m}, 1);
  Robot robot;
  robot.holds = [](int attempt) { return attempt == 1 ? 0 : attempt == 2 ? 100 : 1000; };
  robot.run(core);
  ASSERT_EQ(robot.results.size(), 3U);
  EXPECT_DOUBLE_EQ(robot.results[0].reward, 0.0);
  EXPECT_DOUBLE_EQ(robot.results[1].reward, 0.4);
  EXPECT_DOUBLE_EQ(robot.results[2].reward, 1.0);
  EXPECT_EQ(robot.results[2].steps_held, 250);
}

TEST(TrialsCore, GravityJudgesAndNotWhatTheHandBelieves) {
  TrialsCore core(options(1), {kRest_m}, 1);
  Robot robot;
  robot.fails = [](int, const std::string& action) { return action == "grasp"; };
  robot.run(core);
  ASSERT_EQ(robot.results.size(), 1U);
  EXPECT_FALSE(robot.results[0].closed_on_it);
  EXPECT_DOUBLE_EQ(robot.results[0].reward, 1.0);
}

TEST(TrialsCore, AnArmThatDoesNotGetThereIsNoFailureOfTheFingers) {
  TrialsCore core(options(2), {kRest_m}, 1);
  Robot robot;
  robot.fails = [](int attempt, const std::string& action) { return attempt == 1 && action == "pregrasp"; };
  robot.run(core);
  ASSERT_EQ(robot.results.size(), 2U);
  EXPECT_EQ(robot.results[0].trouble, "because");
  EXPECT_EQ(robot.results[1].trouble, "");
  // home at the start and after the trouble
  EXPECT_EQ(std::count(robot.asked.begin(), robot.asked.end(), "home"), 2);
}

TEST(TrialsCore, ObjectsTakeTurnsAndAreTakenAwayBeforeTheHandComes) {
  TrialOptions o = options(4);
  o.objects = {"blue cube", "red ball"};
  TrialsCore core(o, {kRest_m, kRest_m}, 1);
  Robot robot;
  robot.run(core);
  ASSERT_EQ(robot.results.size(), 4U);
  EXPECT_EQ(robot.results[0].object, "blue cube");
  EXPECT_EQ(robot.results[1].object, "red ball");
  EXPECT_EQ(robot.results[2].object, "blue cube");
  // each is put under the hand once and aside once, and the first is aside at the start
  EXPECT_EQ(robot.put.size(), 9U);
}

TEST(TrialsCore, ThePullGrowsUntilTheTestEndsAndComesFromAllSides) {
  TrialOptions o = options(1);
  o.pull_N = 30;
  TrialsCore core(o, {kRest_m}, 1);
  Robot robot;
  robot.run(core);
  ASSERT_FALSE(robot.pulls.empty());
  double pulled_s = 0;
  double last_N = 0;
  Eigen::Vector3d least = Eigen::Vector3d::Zero();
  Eigen::Vector3d most = Eigen::Vector3d::Zero();
  for (const TrialOutputs::Pull& pull : robot.pulls) {
    EXPECT_GT(pull.f_Root_N.norm(), last_N);
    last_N = pull.f_Root_N.norm();
    pulled_s += pull.duration_s;
    least = least.cwiseMin(pull.f_Root_N);
    most = most.cwiseMax(pull.f_Root_N);
  }
  EXPECT_NEAR(last_N, 30, 1e-9);
  EXPECT_NEAR(pulled_s, 2.5, 1e-9) << "without a gap";
  EXPECT_TRUE((least.array() < -10).all() && most.x() > 10 && most.y() > 10);
}

TEST(TrialsCore, WhatLeansOnAnotherThingIsNotHeld) {
  TrialsCore core(options(1), {kRest_m}, 1);
  TrialInputs inputs;
  std::optional<TrialResult> result;
  for (int tick = 0; tick < 20000 && !result; ++tick) {
    inputs.object_height_m = kRest_m + 0.08;
    inputs.borne_by_other = true;
    const TrialOutputs out = core.step(kTick_s, inputs);
    inputs = {};
    if (out.reach) inputs.reach = TrialInputs::Done{out.reach->id, "done", ""};
    if (out.grasp) inputs.grasp = TrialInputs::Done{out.grasp->id, "done", ""};
    result = out.result;
  }
  ASSERT_TRUE(result);
  EXPECT_DOUBLE_EQ(result->reward, 0.0);
}

TEST(TrialsCore, GravityAloneUnlessAsked) {
  TrialsCore core(options(2), {kRest_m}, 1);
  Robot robot;
  robot.run(core);
  EXPECT_TRUE(robot.pulls.empty());
}

TEST(TrialsCore, EndsWithTheFirstWholeRewardIfAsked) {
  TrialOptions o = options(9);
  o.until_max = true;
  TrialsCore core(o, {kRest_m}, 1);
  Robot robot;
  robot.holds = [](int attempt) { return attempt < 3 ? 249 : 1000; };
  robot.run(core);
  EXPECT_EQ(robot.results.size(), 3U);
}

TEST(TrialsCore, SameSeedSamePlaces) {
  const auto places = [](std::uint64_t seed) {
    TrialsCore core(options(5), {kRest_m}, seed);
    std::vector<double> x;
    TrialInputs inputs;
    for (int tick = 0; tick < 20000; ++tick) {
      inputs.object_height_m = 1;
      const TrialOutputs out = core.step(kTick_s, inputs);
      inputs = {};
      if (out.reach) inputs.reach = TrialInputs::Done{out.reach->id, "done", ""};
      if (out.grasp) inputs.grasp = TrialInputs::Done{out.grasp->id, "done", ""};
      if (out.put) x.push_back(out.put->p_Root_m.x());
      if (out.finished) break;
    }
    return x;
  };
  EXPECT_EQ(places(3), places(3));
  EXPECT_NE(places(3), places(4));
}

}  // namespace
}  // namespace nido::grasp
