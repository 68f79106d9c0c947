#include "nido/reach/reach_core.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "kinematic_robot.h"

namespace nido::reach {
namespace {

Joints home() {
  Joints q = Joints::Zero();
  q.tail<kArmJoints>() << -0.35, 1.05, 0.0, 1.75, 0.0, 0.0, 0.0;
  return q;
}

PalmPosture palm_down(double height_m) {
  PalmPosture posture;
  // fingers forward (root -x), palm to the table
  posture.X_ObjectPalm.linear().col(0) = -Eigen::Vector3d::UnitX();
  posture.X_ObjectPalm.linear().col(1) = Eigen::Vector3d::UnitY();
  posture.X_ObjectPalm.linear().col(2) = -Eigen::Vector3d::UnitZ();
  posture.X_ObjectPalm.translation() = Eigen::Vector3d(0.05, 0.0, height_m);
  posture.turns_rad = {-0.35, 0.0, -0.7, 0.35};
  return posture;
}

ReachCore make_core(const Eigen::Vector3d& p_PalmMark_m = KinematicRobot::mark_Palm_m()) {
  PlannerOptions planner;
  planner.home = home();
  ReachOptions options;
  options.reach_posture = palm_down(0.08);
  options.grasp_postures[""] = palm_down(0.07);
  return {MotionPlanner(right_arm(), SeenHandModel(p_PalmMark_m), std::nullopt, planner), options};
}

struct Outcome {
  ReachStatus status;
  double duration_s = 0.0;
  double fastest_rad_s = 0.0;
  bool in_limits = true;
};

// Runs one action to its end in the kinematic fake, with or without eyes on the hand.
Outcome run(ReachCore& core, KinematicRobot& robot, const ReachGoal& goal, bool with_eyes,
            double most_s = 60.0) {
  Outcome result;
  std::optional<ReachGoal> next = goal;
  std::optional<Joints> last;
  const double begin_s = robot.time_s();
  for (int tick = 0; robot.time_s() - begin_s < most_s; ++tick) {
    ReachInput input;
    input.measured_rad = robot.q();
    if (with_eyes && tick % 3 == 0) input.hand = robot.look();
    input.goal = next;
    next.reset();
    const ReachOutput output = core.step(robot.time_s(), input);
    result.status = output.status;
    if (output.command_rad) {
      if (last)
        result.fastest_rad_s =
            std::max(result.fastest_rad_s, (*output.command_rad - *last).cwiseAbs().maxCoeff() / 0.01);
      last = output.command_rad;
      result.in_limits = result.in_limits && (*output.command_rad - right_arm().min()).minCoeff() > -1e-9 &&
                         (right_arm().max() - *output.command_rad).minCoeff() > -1e-9;
    }
    robot.step(output.command_rad);
    if (output.status.state != ActionState::kRunning) break;
  }
  result.duration_s = robot.time_s() - begin_s;
  return result;
}

ReachGoal goal_at(const std::string& action, const Eigen::Vector3d& p_Root_m) {
  return {1, action, "blue cube", p_Root_m, {0.05, 0.05, 0.05}, 0.0};
}

TEST(ReachCore, PalmArrivesAtRandomThingsAsSeenByBiasedEyes) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  int done = 0;
  constexpr int kGoals = 25;
  for (int i = 0; i < kGoals; ++i) {
    ReachCore core = make_core();
    KinematicRobot robot(home());
    const Eigen::Vector3d p(-0.25 - 0.09 * share(random), 0.02 + 0.18 * share(random), -0.0576);
    const Outcome result = run(core, robot, goal_at("pregrasp", p), true);
    EXPECT_TRUE(result.in_limits);
    EXPECT_LE(result.fastest_rad_s, 0.9 + 1e-6);
    EXPECT_LT(result.duration_s, 20.0);
    if (result.status.state != ActionState::kDone) {
      ADD_FAILURE() << p.transpose() << ": " << result.status.reason;
      continue;
    }
    ++done;
    // the palm as the eyes see it stands over the thing as the eyes see it
    const Eigen::Isometry3d X = right_arm().X_RootPalm(robot.q());
    const Eigen::Vector3d seen = robot.seen_palm() - p;
    EXPECT_NEAR(std::hypot(seen.x(), seen.y()), 0.05, 0.006) << p.transpose();
    EXPECT_NEAR(seen.z(), 0.07, 0.006);
    EXPECT_LT(result.status.error_m, 0.006);
    EXPECT_GT(-X.linear().col(2).z(), 0.99) << "palm down";
  }
  EXPECT_EQ(done, kGoals);
}

TEST(ReachCore, WithoutEyesTheLearnedModelAloneIsFollowed) {
  ReachCore core = make_core();
  KinematicRobot robot(home());
  const Outcome result = run(core, robot, goal_at("reach", {-0.28, 0.1, -0.0576}), false);
  ASSERT_EQ(result.status.state, ActionState::kDone) << result.status.reason;
  EXPECT_NEAR(right_arm().X_RootPalm(robot.q()).translation().z(), -0.0576 + 0.08, 0.003);
}

TEST(ReachCore, PregraspLiftCarryHomeInSequence) {
  ReachCore core = make_core();
  KinematicRobot robot(home());
  const Eigen::Vector3d cube(-0.28, 0.06, -0.0576);
  ASSERT_EQ(run(core, robot, goal_at("pregrasp", cube), true).status.state, ActionState::kDone);
  const Eigen::Isometry3d X_grasp = right_arm().X_RootPalm(robot.q());

  const Outcome lift = run(core, robot, goal_at("lift", cube + Eigen::Vector3d(0, 0, 0.12)), false);
  ASSERT_EQ(lift.status.state, ActionState::kDone) << lift.status.reason;
  const Eigen::Isometry3d X_lift = right_arm().X_RootPalm(robot.q());
  EXPECT_NEAR(X_lift.translation().z() - X_grasp.translation().z(), 0.12, 0.01);
  EXPECT_LT((X_lift.translation() - X_grasp.translation()).head<2>().norm(), 0.02);

  ReachGoal basket{3, "carry", "blue cube", {-0.27, 0.24, 0.08}, {0.05, 0.05, 0.05}, 0.0};
  const Outcome carry = run(core, robot, basket, false);
  ASSERT_EQ(carry.status.state, ActionState::kDone) << carry.status.reason;
  const Eigen::Isometry3d X_carry = right_arm().X_RootPalm(robot.q());
  // the held cube hangs where it hung in the hand
  const Eigen::Vector3d held =
      X_carry * (X_grasp.inverse() * (cube - (robot.seen_palm() - X_carry.translation())));
  EXPECT_LT((held - basket.p_Root_m).head<2>().norm(), 0.03);
  EXPECT_GT(held.z(), 0.03);
  EXPECT_GT(X_carry.linear().col(2).dot(X_grasp.linear().col(2)), 0.97) << "the palm keeps its tilt";

  const Outcome back = run(core, robot, goal_at("home", {0, 0, 0}), false);
  ASSERT_EQ(back.status.state, ActionState::kDone) << back.status.reason;
  EXPECT_LT((robot.q() - home()).cwiseAbs().maxCoeff(), 0.02);
}

TEST(ReachCore, TheWayNeverEntersTheTableOrThings) {
  ReachCore core = make_core();
  KinematicRobot robot(home());
  const std::vector<SeenObject> things = {{"blue cube", {-0.30, 0.05, -0.0576}, {0.05, 0.05, 0.05}},
                                          {"red ball", {-0.25, 0.17, -0.0526}, {0.06, 0.06, 0.06}}};
  ReachInput input;
  input.measured_rad = robot.q();
  input.objects = things;
  input.goal = goal_at("pregrasp", things[0].p_Root_m);
  double least = 1.0;
  for (int tick = 0; tick < 3000; ++tick) {
    const ReachOutput output = core.step(robot.time_s(), input);
    input = {};
    robot.step(output.command_rad);
    input.measured_rad = robot.q();
    for (const auto& point : right_arm().body_points(robot.q())) {
      const Eigen::Vector3d& p = point.p_Root_m;
      if (p.x() < -0.2 && std::abs(p.y()) < 0.35) least = std::min(least, p.z() + 0.0826);
      EXPECT_GT((p - things[1].p_Root_m).norm(), 0.025) << "through the ball";
    }
    if (output.status.state != ActionState::kRunning) {
      ASSERT_EQ(output.status.state, ActionState::kDone) << output.status.reason;
      break;
    }
  }
  EXPECT_GT(least, 0.0);
}

TEST(ReachCore, ThingsOutOfReachAreRefusedWithPlaceAndDistance) {
  ReachCore core = make_core();
  KinematicRobot robot(home());
  const Outcome result = run(core, robot, goal_at("reach", {-0.9, 0.1, -0.05}), false);
  EXPECT_EQ(result.status.state, ActionState::kFailed);
  EXPECT_LT(result.duration_s, 1.0);
  EXPECT_NE(result.status.reason.find("blue cube"), std::string::npos) << result.status.reason;
  EXPECT_NE(result.status.reason.find("0.90 m in front"), std::string::npos) << result.status.reason;
}

TEST(ReachCore, BadGoalsAreRefusedAndTheArmStays) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  ReachCore core = make_core();
  KinematicRobot robot(home());
  std::vector<ReachGoal> bad(5, goal_at("reach", {-0.28, 0.1, -0.05}));
  bad[0].action = "dance";
  bad[1].p_Root_m.x() = kNan;
  bad[2].size_m.z() = -1.0;
  bad[3].yaw_rad = std::numeric_limits<double>::infinity();
  bad[4].p_Root_m = Eigen::Vector3d(1e9, 0, 0);
  for (const ReachGoal& goal : bad) {
    const Outcome result = run(core, robot, goal, false, 2.0);
    EXPECT_EQ(result.status.state, ActionState::kFailed);
    EXPECT_FALSE(result.status.reason.empty());
    EXPECT_LT((robot.q() - home()).norm(), 1e-6);
  }
}

TEST(ReachCore, ANewGoalTakesOverWithoutAJump) {
  ReachCore core = make_core();
  KinematicRobot robot(home());
  std::optional<Joints> last;
  double fastest_change = 0.0;
  Joints last_step = Joints::Zero();
  ReachStatus status;
  for (int tick = 0; tick < 2500; ++tick) {
    ReachInput input;
    input.measured_rad = robot.q();
    if (tick == 0) input.goal = goal_at("reach", {-0.28, 0.05, -0.0576});
    if (tick == 90)
      input.goal = ReachGoal{2, "reach", "red ball", {-0.27, 0.18, -0.0526}, {0.06, 0.06, 0.06}, 0.0};
    const ReachOutput output = core.step(robot.time_s(), input);
    status = output.status;
    ASSERT_TRUE(output.command_rad);
    if (last) {
      const Joints step = *output.command_rad - *last;
      fastest_change = std::max(fastest_change, (step - last_step).cwiseAbs().maxCoeff());
      last_step = step;
    }
    last = output.command_rad;
    robot.step(output.command_rad);
    if (tick > 90 && status.state != ActionState::kRunning) break;
  }
  EXPECT_EQ(status.id, 2U);
  EXPECT_EQ(status.state, ActionState::kDone) << status.reason;
  EXPECT_LT(fastest_change, 0.003) << "rad in a tick of a tick";
}

TEST(ReachCore, StopHoldsTheArm) {
  ReachCore core = make_core();
  KinematicRobot robot(home());
  ReachInput input;
  for (int tick = 0; tick < 100; ++tick) {
    input.measured_rad = robot.q();
    input.goal = tick == 0 ? std::optional(goal_at("reach", {-0.28, 0.05, -0.0576})) : std::nullopt;
    robot.step(core.step(robot.time_s(), input).command_rad);
  }
  const Outcome stopped = run(core, robot, goal_at("stop", {0, 0, 0}), false);
  EXPECT_EQ(stopped.status.state, ActionState::kDone);
  EXPECT_LT(stopped.duration_s, 0.5);
  const Joints there = core.step(robot.time_s(), {robot.q(), {}, {}, {}}).command_rad.value();
  for (int tick = 0; tick < 50; ++tick) {
    robot.step(core.step(robot.time_s(), {robot.q(), {}, {}, {}}).command_rad);
  }
  EXPECT_LT((robot.q() - there).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(ReachCore, ABlockedArmAndMissingEncodersEndTheAction) {
  ReachCore blocked = make_core();
  KinematicRobot robot(home());
  ReachStatus status;
  std::optional<ReachGoal> goal = goal_at("reach", {-0.28, 0.05, -0.0576});
  for (int tick = 0; tick < 2000; ++tick) {
    const ReachOutput output = blocked.step(0.01 * tick, {home(), {}, {}, goal});  // the arm does not move
    goal.reset();
    status = output.status;
    if (status.state != ActionState::kRunning) break;
  }
  EXPECT_EQ(status.state, ActionState::kFailed);
  EXPECT_NE(status.reason.find("blocked"), std::string::npos) << status.reason;

  ReachCore deaf = make_core();
  goal = goal_at("home", {0, 0, 0});
  for (int tick = 0; tick < 500; ++tick) {
    status = deaf.step(0.01 * tick, {{}, {}, {}, goal}).status;
    goal.reset();
    if (status.state != ActionState::kRunning) break;
  }
  EXPECT_EQ(status.state, ActionState::kFailed);
  EXPECT_NE(status.reason.find("encoders"), std::string::npos) << status.reason;
}

TEST(ReachCore, WildSightingsAreNotBelieved) {
  ReachCore core = make_core();
  KinematicRobot robot(home());
  ReachInput input;
  for (int tick = 0; tick < 200; ++tick) {
    input.measured_rad = robot.q();
    HandSighting wild = robot.look();
    wild.p_Root_m += Eigen::Vector3d(0.1, -0.2, 0.1);
    input.hand = wild;
    core.step(robot.time_s(), input);
    robot.step(std::nullopt);
  }
  EXPECT_TRUE(core.visual_offset_m().isZero());
}

}  // namespace
}  // namespace nido::reach
