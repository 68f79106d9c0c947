#pragma once

// The contracts of control in the space of the task, run unchanged on every family of boards and through the
// network. Include it in one file of a test program.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>

#include "task_control_rig.h"

namespace nido::test {

using TaskRigFactory = std::function<std::unique_ptr<TaskRig>()>;

class TaskContract : public testing::TestWithParam<TaskRigFactory> {
 protected:
  void SetUp() override { rig_ = GetParam()(); }
  template <class Condition>
  bool eventually(double within_s, Condition condition) {
    for (int period = 0; period < static_cast<int>(within_s * 100); ++period) {
      if (condition()) return true;
      rig_->advance();
    }
    return condition();
  }
  CartesianState hand() { return *rig_->hand().state(); }
  GazeState gaze() { return *rig_->gaze().state(); }
  // moved by so much from where the hand is
  CartesianGoal goal(const Eigen::Vector3d& by_m) {
    CartesianGoal goal;
    goal.X_RootPalm = hand().X_RootPalm;
    goal.X_RootPalm.translation() += by_m;
    return goal;
  }
  std::unique_ptr<TaskRig> rig_;
};

TEST_P(TaskContract, TheHandGoesToAPose) {
  CartesianGoal there = goal({-0.06, -0.03, 0.08});
  there.X_RootPalm.rotate(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  ASSERT_TRUE(rig_->hand().go_to(there).ok()) << rig_->hand().go_to(there).error().message;
  EXPECT_TRUE(eventually(0.5, [&] { return hand().moving; }));
  EXPECT_TRUE(eventually(8.0, [&] { return !hand().moving; }));
  EXPECT_TRUE(eventually(2.0, [&] { return hand().position_error_m < rig_->tolerance_m(); }))
      << hand().position_error_m;
  EXPECT_LT(hand().turn_error_rad, 0.0175 * rig_->tolerance_m() / 0.002);
}

TEST_P(TaskContract, TheWayIsStraight) {
  const CartesianGoal there = goal({-0.05, 0.0, 0.08});
  const Eigen::Vector3d from_m = hand().X_RootPalm.translation();
  const Eigen::Vector3d way_m = there.X_RootPalm.translation() - from_m;
  ASSERT_TRUE(rig_->hand().go_to(there).ok());
  double worst_m = 0;
  eventually(8.0, [&] {
    const Eigen::Vector3d gone_m = hand().X_RootPalm.translation() - from_m;
    worst_m = std::max(worst_m, gone_m.cross(way_m.normalized()).norm());
    return !hand().moving;
  });
  EXPECT_LT(worst_m, 0.01);
}

TEST_P(TaskContract, ADurationIsKept) {
  CartesianGoal there = goal({0.0, 0.0, 0.05});
  there.duration_s = 2.0;
  ASSERT_TRUE(rig_->hand().go_to(there).ok());
  EXPECT_FALSE(eventually(1.5, [&] { return hand().position_error_m < 0.002; }));
  EXPECT_TRUE(eventually(2.0, [&] { return !hand().moving; }));
}

TEST_P(TaskContract, APlanMovesNothingAndComesTrue) {
  const Eigen::Vector3d before_m = hand().X_RootPalm.translation();
  const CartesianGoal there = goal({-0.04, 0.0, 0.06});
  const Result<CartesianPlan> plan = rig_->hand().plan(there);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_GE(plan->joints_rad.size(), 7U);
  EXPECT_LT(plan->position_error_m, 0.002);
  EXPECT_LT(plan->turn_error_rad, 0.0175);
  eventually(0.2, [] { return false; });
  EXPECT_LT((hand().X_RootPalm.translation() - before_m).norm(), 0.003);
}

TEST_P(TaskContract, WhatIsOutOfReachIsRefusedAndNothingMoves) {
  const Eigen::Vector3d before_m = hand().X_RootPalm.translation();
  EXPECT_FALSE(rig_->hand().go_to(goal({-3.0, 0.0, 0.0})).ok());
  CartesianGoal nonsense = goal({0, 0, 0});
  nonsense.X_RootPalm.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(rig_->hand().go_to(nonsense).ok());
  EXPECT_FALSE(rig_->hand().plan(nonsense).ok());
  eventually(0.2, [] { return false; });
  EXPECT_FALSE(hand().moving);
  EXPECT_LT((hand().X_RootPalm.translation() - before_m).norm(), 0.003);
}

TEST_P(TaskContract, TheHandStopsOnItsWay) {
  const CartesianGoal there = goal({-0.05, 0.0, 0.12});
  ASSERT_TRUE(rig_->hand().go_to(there).ok());
  ASSERT_TRUE(eventually(5.0, [&] { return hand().position_error_m < 0.08; }));
  ASSERT_TRUE(rig_->hand().stop().ok());
  EXPECT_TRUE(eventually(0.5, [&] { return !hand().moving; }));
  eventually(0.3, [] { return false; });
  const Eigen::Vector3d stopped_m = hand().X_RootPalm.translation();
  eventually(0.5, [] { return false; });
  EXPECT_LT((hand().X_RootPalm.translation() - stopped_m).norm(), 0.003);
  EXPECT_GT(hand().position_error_m, 0.01);
}

TEST_P(TaskContract, TheHandGoesOnAtASpeed) {
  const Eigen::Isometry3d before = hand().X_RootPalm;
  ASSERT_TRUE(rig_->hand().go_on({0, 0, 0.05}, Eigen::Vector3d::Zero(), 10).ok());
  EXPECT_TRUE(
      eventually(3.0, [&] { return hand().X_RootPalm.translation().z() > before.translation().z() + 0.05; }));
  EXPECT_NEAR(hand().v_m_s.z(), 0.05, 0.02);
  EXPECT_TRUE(hand().moving);
  const Eigen::Vector3d gone_m = hand().X_RootPalm.translation() - before.translation();
  EXPECT_LT(gone_m.head<2>().norm(), 0.01) << "straight up";
  ASSERT_TRUE(rig_->hand().stop().ok());
  EXPECT_TRUE(eventually(1.0, [&] { return !hand().moving && hand().v_m_s.norm() < 0.01; }));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(rig_->hand().go_on({0, nan, 0}, Eigen::Vector3d::Zero(), 1).ok());
  EXPECT_FALSE(rig_->hand().go_on({100, 0, 0}, Eigen::Vector3d::Zero(), 1).ok());
  for (const double for_s : {nan, 0.0, -1.0, 1e9}) {
    EXPECT_FALSE(rig_->hand().go_on({0, 0, 0.05}, Eigen::Vector3d::Zero(), for_s).ok()) << for_s;
  }
}

TEST_P(TaskContract, ASpeedThatNobodyRepeatsEnds) {
  const Eigen::Vector3d up_m_s(0, 0, 0.05);
  const auto height_m = [&] { return hand().X_RootPalm.translation().z(); };
  const double before_m = height_m();
  ASSERT_TRUE(rig_->hand().go_on(up_m_s, Eigen::Vector3d::Zero(), kTaskSpeedHolds_s).ok());
  const std::uint32_t motion = hand().motion;
  // repeated it goes on, and is still the same motion
  EXPECT_TRUE(eventually(5.0, [&] {
    EXPECT_TRUE(rig_->hand().go_on(up_m_s, Eigen::Vector3d::Zero(), kTaskSpeedHolds_s).ok());
    return height_m() > before_m + 0.03;
  }));
  EXPECT_EQ(hand().motion, motion);
  // who gave it is gone
  int periods = 0;
  EXPECT_TRUE(eventually(0.5, [&] {
    ++periods;
    return !hand().moving;
  }));
  EXPECT_LE(periods, 12) << "the order ends within 100 ms of the robot's time";
  eventually(0.2, [] { return false; });
  const double stopped_m = height_m();
  eventually(0.5, [] { return false; });
  EXPECT_NEAR(height_m(), stopped_m, rig_->tolerance_m());
  EXPECT_GE(hand().progress, 1) << "its time was over";
  ASSERT_TRUE(rig_->hand().stop().ok());
  EXPECT_NE(hand().motion, motion) << "every other order is a new motion";
}

TEST_P(TaskContract, WhatMovesIsSet) {
  constexpr std::size_t kTorso = 3;
  const CartesianSettings before = *rig_->hand().settings();
  ASSERT_EQ(before.moves.size(), 10U);
  CartesianSettings arm_only = before;
  for (std::size_t j = 0; j < kTorso; ++j) arm_only.moves[j] = false;
  arm_only.upper_rad[4] = arm_only.lower_rad[4] + 0.9 * (before.upper_rad[4] - before.lower_rad[4]);
  arm_only.rest_rad[5] = 0.1;
  ASSERT_TRUE(rig_->hand().set_settings(arm_only).ok());
  const CartesianSettings told = *rig_->hand().settings();
  EXPECT_EQ(told.moves, arm_only.moves);
  EXPECT_NEAR(told.upper_rad[4], arm_only.upper_rad[4], 1e-9);
  EXPECT_NEAR(told.rest_rad[5].value_or(9), 0.1, 1e-9);
  EXPECT_FALSE(told.rest_rad[4].has_value());
  const CartesianGoal there = goal({-0.02, 0.02, 0.05});
  const CartesianPlan plan = *rig_->hand().plan(there);
  EXPECT_LT(plan.position_error_m, 0.002);
  EXPECT_LT((plan.X_RootPalm.translation() - there.X_RootPalm.translation()).norm(), 0.002);
  const CartesianPlan stays = *rig_->hand().plan(goal({0, 0, 0}));
  for (std::size_t j = 0; j < kTorso; ++j) EXPECT_NEAR(plan.joints_rad[j], stays.joints_rad[j], 0.01) << j;
  // a place beside the palm is brought to the goal
  CartesianSettings tool = before;
  tool.X_PalmTip.translation().x() = 0.1;
  const Eigen::Vector3d tip_m = hand().X_RootPalm * Eigen::Vector3d(0.1, 0, 0);
  ASSERT_TRUE(rig_->hand().set_settings(tool).ok());
  EXPECT_LT((hand().X_RootPalm.translation() - tip_m).norm(), 0.003);
  EXPECT_LT((rig_->hand().X_RootLink(9)->translation() - tip_m).norm(), 0.003);
  EXPECT_FALSE(rig_->hand().X_RootLink(10).ok());
  EXPECT_FALSE(rig_->hand().X_RootLink(-1).ok());
  // nonsense changes nothing
  CartesianSettings wrong = before;
  wrong.upper_rad[0] += 1;
  EXPECT_FALSE(rig_->hand().set_settings(wrong).ok());
  wrong = before;
  wrong.lower_rad[0] = wrong.upper_rad[0] + 0.1;
  EXPECT_FALSE(rig_->hand().set_settings(wrong).ok());
  EXPECT_NEAR(rig_->hand().settings()->X_PalmTip.translation().x(), 0.1, 1e-9);
  ASSERT_TRUE(rig_->hand().set_settings(before).ok());
}

TEST_P(TaskContract, HowTheHeadTurnsIsSet) {
  EXPECT_GT(rig_->gaze().body()->baseline_m, 0.05);
  const GazeSettings before = *rig_->gaze().settings();
  GazeSettings still = before;
  still.neck_s = 1.5;
  still.neck_lower_rad[1] = still.neck_upper_rad[1] = 0;
  still.neck_lower_rad[2] = -0.1;
  still.neck_upper_rad[2] = 0.1;
  ASSERT_TRUE(rig_->gaze().set_settings(still).ok());
  EXPECT_NEAR(rig_->gaze().settings()->neck_upper_rad[2], 0.1, 1e-9);
  ASSERT_TRUE(rig_->gaze().look_at({-0.5, 0.2, 0.2}).ok());
  EXPECT_TRUE(eventually(0.5, [&] { return gaze().moving; }));
  EXPECT_TRUE(eventually(6.0, [&] { return !gaze().moving && gaze().error_px < rig_->tolerance_px(); }));
  EXPECT_LT(std::abs(gaze().wanted_rad[2]), 0.1001) << "the neck stays in its range, the eyes do the rest";
  EXPECT_GT(std::abs(gaze().wanted_rad[4]), 0.05);
  // the eyes straight ahead: the neck alone
  GazeSettings staring = before;
  staring.vergence_rad = 0.1;
  ASSERT_TRUE(rig_->gaze().set_settings(staring).ok());
  EXPECT_NEAR(rig_->gaze().settings()->vergence_rad.value_or(0), 0.1, 1e-9);
  ASSERT_TRUE(rig_->gaze().look_at({-0.5, 0.1, 0.2}).ok());
  EXPECT_NEAR(gaze().wanted_rad[4], 0, 1e-6);
  EXPECT_NEAR(gaze().wanted_rad[5], 0.1, 1e-6);
  GazeSettings wrong = before;
  wrong.neck_upper_rad[0] += 1;
  EXPECT_FALSE(rig_->gaze().set_settings(wrong).ok());
  wrong = before;
  wrong.eyes_s = 0;
  EXPECT_FALSE(rig_->gaze().set_settings(wrong).ok());
  ASSERT_TRUE(rig_->gaze().set_settings(before).ok());
  ASSERT_TRUE(rig_->gaze().stop().ok());
}

TEST_P(TaskContract, SaccadesAndWhatTheEyesMakeUpForAreSet) {
  const GazeSettings before = *rig_->gaze().settings();
  EXPECT_EQ(before.eyes_make_up, 1);
  EXPECT_FALSE(before.saccades.has_value());
  // until the point is seen, s, from another one: the neck takes 2, the eyes 1.5
  const auto seen_after_s = [&](std::optional<GazeSettings::Saccades> saccades, double eyes_make_up) {
    EXPECT_TRUE(rig_->gaze().set_settings(before).ok());
    EXPECT_TRUE(rig_->gaze().look_at({-0.5, -0.15, 0.2}).ok());
    EXPECT_TRUE(eventually(5.0, [&] { return !gaze().moving && gaze().error_px < rig_->tolerance_px(); }));
    GazeSettings slow = before;
    slow.neck_s = 2;
    slow.eyes_s = 1.5;
    slow.saccades = saccades;
    slow.eyes_make_up = eyes_make_up;
    EXPECT_TRUE(rig_->gaze().set_settings(slow).ok());
    const GazeSettings told = *rig_->gaze().settings();
    EXPECT_EQ(told.saccades.has_value(), saccades.has_value());
    EXPECT_NEAR(told.eyes_make_up, eyes_make_up, 1e-9);
    const std::int64_t begun_ns = gaze().stamp_ns;
    EXPECT_TRUE(rig_->gaze().look_at({-0.5, 0.15, 0.2}).ok());
    EXPECT_TRUE(eventually(5.0, [&] { return gaze().error_px < 10; }));
    return static_cast<double>(gaze().stamp_ns - begun_ns) * 1e-9;
  };
  const GazeSettings::Saccades from_a_little{.from_rad = 0.2, .apart_s = 0};
  const GazeSettings::Saccades from_much{.from_rad = 1.5, .apart_s = 0};
  const double slowly_s = seen_after_s(std::nullopt, 1);
  const double jumped_s = seen_after_s(from_a_little, 1);
  EXPECT_LT(jumped_s, slowly_s - 0.2) << "a saccade is as fast as the eyes";
  EXPECT_GT(seen_after_s(from_much, 1), jumped_s + 0.2) << "it is not that far";
  EXPECT_GT(seen_after_s(from_a_little, 0), jumped_s + 0.2) << "the neck carries the eyes";
  // not so soon after another one
  EXPECT_GT(seen_after_s(GazeSettings::Saccades{.from_rad = 0.2, .apart_s = 60}, 1), jumped_s + 0.2);
  for (const auto& [from_rad, apart_s, eyes_make_up] :
       {std::array{-0.1, 0.2, 1.0}, {4.0, 0.2, 1.0}, {0.2, -1.0, 1.0}, {0.2, 0.2, 1.5}, {0.2, 0.2, -0.5}}) {
    GazeSettings wrong = before;
    wrong.saccades = {from_rad, apart_s};
    wrong.eyes_make_up = eyes_make_up;
    EXPECT_FALSE(rig_->gaze().set_settings(wrong).ok()) << from_rad << ' ' << apart_s << ' ' << eyes_make_up;
  }
  ASSERT_TRUE(rig_->gaze().set_settings(before).ok());
  ASSERT_TRUE(rig_->gaze().stop().ok());
}

TEST_P(TaskContract, BothEyesLookAtAPoint) {
  for (const Eigen::Vector3d& p_Root_m :
       {Eigen::Vector3d(-0.5, 0.15, 0.1), Eigen::Vector3d(-0.35, -0.2, 0.0)}) {
    ASSERT_TRUE(rig_->gaze().look_at(p_Root_m).ok());
    EXPECT_TRUE(eventually(5.0, [&] {
      const GazeState now = gaze();
      return !now.moving && now.error_px < rig_->tolerance_px();
    })) << gaze().error_px;
    EXPECT_LT((gaze().p_RootFixation_m - p_Root_m).norm(), 0.03 * rig_->tolerance_px());
  }
  ASSERT_TRUE(rig_->gaze().stop().ok());
}

TEST_P(TaskContract, APixelIsLookedAt) {
  ASSERT_TRUE(rig_->gaze().look_at({-0.5, 0.0, 0.1}).ok());
  ASSERT_TRUE(eventually(5.0, [&] { return !gaze().moving; }));
  const double height_m = gaze().p_RootFixation_m.z();
  ASSERT_TRUE(rig_->gaze().look_at_pixel(0, {160, 40}, 0.6).ok());
  ASSERT_TRUE(eventually(0.5, [&] { return gaze().moving; }));
  ASSERT_TRUE(eventually(5.0, [&] { return !gaze().moving; }));
  EXPECT_GT(gaze().p_RootFixation_m.z(), height_m + 0.05) << "a pixel further up is higher";
}

TEST_P(TaskContract, TwoPixelsOfOnePointAreLookedAt) {
  ASSERT_TRUE(rig_->gaze().look_at({-0.5, 0.0, 0.1}).ok());
  ASSERT_TRUE(eventually(5.0, [&] { return !gaze().moving; }));
  // up, and as far away as what both pictures show in their middle
  const Eigen::Vector3d before_m = gaze().p_RootFixation_m;
  ASSERT_TRUE(rig_->gaze().look_at_pixels({160, 60}, {160, 60}).ok());
  ASSERT_TRUE(eventually(5.0, [&] { return !gaze().moving && gaze().error_px < rig_->tolerance_px(); }));
  EXPECT_GT(gaze().p_RootFixation_m.z(), before_m.z() + 0.04);
  EXPECT_NEAR(gaze().p_RootFixation_m.y(), before_m.y(), 0.02 * rig_->tolerance_px());
  EXPECT_FALSE(rig_->gaze().look_at_pixels({60, 120}, {260, 120}).ok()) << "the lines part before the eyes";
  EXPECT_FALSE(rig_->gaze().look_at_pixels({-1, 120}, {260, 120}).ok());
}

TEST_P(TaskContract, AnglesAreLookedBy) {
  constexpr double kDegree = 3.14159265358979323846 / 180;
  const double tolerance_rad = 0.2 * kDegree * rig_->tolerance_px();
  const auto arrives = [&] {
    return eventually(5.0, [&] { return !gaze().moving && gaze().error_px < rig_->tolerance_px(); });
  };
  const Eigen::Vector3d wanted_rad = Eigen::Vector3d(12, -15, 6) * kDegree;
  ASSERT_TRUE(rig_->gaze().look_by_angles(false, wanted_rad).ok());
  ASSERT_TRUE(arrives());
  const Eigen::Vector3d angles_rad = gaze().angles_rad;
  EXPECT_LT((angles_rad - wanted_rad).cwiseAbs().maxCoeff(), tolerance_rad) << angles_rad / kDegree;
  EXPECT_GT(gaze().p_RootFixation_m.y(), 0.03) << "a positive azimuth is to the robot's right";
  // from there a little further up
  const double height_m = gaze().p_RootFixation_m.z();
  ASSERT_TRUE(rig_->gaze().look_by_angles(true, Eigen::Vector3d(0, 8, 0) * kDegree).ok());
  ASSERT_TRUE(arrives());
  EXPECT_GT(gaze().p_RootFixation_m.z(), height_m + 0.02);
  EXPECT_FALSE(rig_->gaze().look_by_angles(false, Eigen::Vector3d(170, 0, 5) * kDegree).ok());
  EXPECT_FALSE(rig_->gaze().look_by_angles(false, {std::numeric_limits<double>::quiet_NaN(), 0.0, 0.1}).ok());
  // the eyes are where the lines of sight come from
  const GazeState now = gaze();
  for (const Eigen::Isometry3d& X_RootEye : now.X_RootEyes) {
    const Eigen::Vector3d p_EyeFixation_m = X_RootEye.inverse() * now.p_RootFixation_m;
    EXPECT_LT(p_EyeFixation_m.head<2>().norm(), 0.02 * p_EyeFixation_m.norm());
    EXPECT_GT(p_EyeFixation_m.z(), 0);
  }
}

TEST_P(TaskContract, WhatCannotBeLookedAtIsRefused) {
  EXPECT_FALSE(rig_->gaze().look_at({2.0, 0.0, 0.3}).ok()) << "behind the head";
  EXPECT_FALSE(rig_->gaze().look_at({-0.4, std::numeric_limits<double>::infinity(), 0.3}).ok());
  EXPECT_FALSE(rig_->gaze().look_at_pixel(2, {10, 10}, 0.5).ok());
  EXPECT_FALSE(rig_->gaze().look_at_pixel(0, {-10, 10}, 0.5).ok());
  EXPECT_FALSE(rig_->gaze().look_at_pixel(0, {10, 10}, 0.0).ok());
}

}  // namespace nido::test
