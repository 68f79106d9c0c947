#pragma once

// The contract of frames, run unchanged on every family of boards and through the network. Include it in one
// file of a test program.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "task_control_rig.h"

namespace nido::test {

class FrameContract : public testing::TestWithParam<std::function<std::unique_ptr<TaskRig>()>> {
 protected:
  void SetUp() override {
    rig_ = GetParam()();
    rig_->advance();
  }
  IFrameTransforms& frames() { return rig_->frames(); }
  Eigen::Isometry3d X(const std::string& base, const std::string& frame) {
    const Result<FrameTransform> found = frames().transform(base, frame);
    EXPECT_TRUE(found.ok()) << base << ' ' << frame << ": " << (found ? "" : found.error().message);
    return found ? found->X_BaseFrame : Eigen::Isometry3d::Identity();
  }
  static Eigen::Isometry3d at(double x_m, double y_m, double z_m) {
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.translation() = Eigen::Vector3d(x_m, y_m, z_m);
    return X;
  }
  static double apart(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
    return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
  }
  std::unique_ptr<TaskRig> rig_;
};

TEST_P(FrameContract, TheHandIsWhereTheHandsDeviceSays) {
  const CartesianState before = *rig_->hand().state();
  EXPECT_LT(apart(X("root_link", "r_hand"), before.X_RootPalm), 1e-6);
  CartesianGoal goal;
  goal.X_RootPalm = before.X_RootPalm;
  goal.X_RootPalm.translation() += Eigen::Vector3d(-0.04, 0, 0.05);
  goal.with_orientation = false;
  ASSERT_TRUE(rig_->hand().go_to(goal).ok());
  for (int period = 0; period < 400 && (period < 10 || rig_->hand().state()->moving); ++period)
    rig_->advance();
  const CartesianState after = *rig_->hand().state();
  EXPECT_GT((after.X_RootPalm.translation() - before.X_RootPalm.translation()).norm(), 0.03);
  const Result<FrameTransform> palm = frames().transform("root_link", "r_hand");
  ASSERT_TRUE(palm.ok());
  EXPECT_LT(apart(palm->X_BaseFrame, after.X_RootPalm), 1e-3);
  EXPECT_GT(palm->stamp_ns, before.stamp_ns);
}

TEST_P(FrameContract, TransformsComposeAndTurnRound) {
  EXPECT_LT(apart(X("r_hand", "r_hand"), Eigen::Isometry3d::Identity()), 1e-9);
  EXPECT_LT(apart(X("r_hand", "l_eye"), X("l_eye", "r_hand").inverse()), 1e-6);
  EXPECT_LT(apart(X("root_link", "l_eye"), X("root_link", "r_hand") * X("r_hand", "l_eye")), 1e-6);
}

TEST_P(FrameContract, AFrameThatIsPutMovesWithItsParent) {
  ASSERT_TRUE(frames().put("r_hand", "tool", at(0.1, 0, 0)).ok());
  ASSERT_TRUE(frames().put("tool", "tool/tip", at(0, 0, 0.05)).ok());
  EXPECT_LT(apart(X("r_hand", "tool/tip"), at(0.1, 0, 0.05)), 1e-9);
  EXPECT_LT(apart(X("root_link", "tool/tip"), X("root_link", "r_hand") * at(0.1, 0, 0.05)), 1e-6);
  ASSERT_TRUE(frames().put("r_hand", "tool", at(0.2, 0, 0)).ok()) << "it is put elsewhere";
  EXPECT_LT(apart(X("r_hand", "tool/tip"), at(0.2, 0, 0.05)), 1e-9);
  const std::vector<Frame> all = *frames().frames();
  const auto place = [&](const std::string& name) {
    return std::find_if(all.begin(), all.end(), [&](const Frame& frame) { return frame.name == name; });
  };
  ASSERT_NE(place("tool/tip"), all.end());
  EXPECT_EQ(place("tool/tip")->parent, "tool");
  EXPECT_TRUE(place("tool/tip")->is_put);
  EXPECT_LT(place("tool"), place("tool/tip")) << "parents come first";
  ASSERT_NE(place("r_hand"), all.end());
  EXPECT_FALSE(place("r_hand")->is_put);
  ASSERT_TRUE(frames().remove("tool").ok());
  EXPECT_FALSE(frames().transform("r_hand", "tool/tip").ok());
}

TEST_P(FrameContract, WhatNothingConnectsIsSaid) {
  ASSERT_TRUE(frames().put("tripod", "marker", at(0, 0, 1)).ok()) << "where the tripod is comes later";
  EXPECT_LT(apart(X("tripod", "marker"), at(0, 0, 1)), 1e-9);
  const Result<FrameTransform> apart_from_it = frames().transform("root_link", "marker");
  ASSERT_FALSE(apart_from_it.ok());
  EXPECT_NE(apart_from_it.error().message.find("tripod"), std::string::npos) << apart_from_it.error().message;
  ASSERT_TRUE(frames().put("root_link", "tripod", at(-1, 0, 0)).ok());
  EXPECT_LT(apart(X("root_link", "marker"), at(-1, 0, 1)), 1e-9);
}

TEST_P(FrameContract, NonsenseIsRefusedAndChangesNothing) {
  EXPECT_FALSE(frames().transform("root_link", "third_hand").ok());
  EXPECT_FALSE(frames().transform("", "root_link").ok());
  EXPECT_FALSE(frames().remove("r_hand").ok()) << "a link of the body";
  EXPECT_FALSE(frames().put("root_link", "r_hand", at(0, 0, 0)).ok()) << "its joints move it";
  EXPECT_FALSE(frames().put("root_link", "", at(0, 0, 0)).ok());
  EXPECT_FALSE(frames().put("root_link", "a b", at(0, 0, 0)).ok());
  EXPECT_FALSE(frames().put("self", "self", at(0, 0, 0)).ok());
  EXPECT_FALSE(frames().put("root_link", "far", at(std::numeric_limits<double>::infinity(), 0, 0)).ok());
  Eigen::Isometry3d bent = at(0, 0, 0);
  bent.linear()(0, 0) = 2;
  EXPECT_FALSE(frames().put("root_link", "bent", bent).ok());
  ASSERT_TRUE(frames().put("upper", "lower", at(0, 0, 0)).ok());
  EXPECT_FALSE(frames().put("lower", "upper", at(0, 0, 0)).ok()) << "each would move with the other";
  const std::vector<Frame> all = *frames().frames();
  for (const Frame& frame : all) {
    EXPECT_EQ(frame.is_put, frame.name == "lower") << frame.name;
  }
}

}  // namespace nido::test
