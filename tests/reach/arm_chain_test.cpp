#include "nido/reach/arm_chain.h"

#include <gtest/gtest.h>

#include <random>

#include "kinematic_robot.h"
#include "nido/reach/inverse_kinematics.h"

namespace nido::reach {
namespace {

Joints random_posture(std::mt19937_64& random) {
  std::uniform_real_distribution<double> share(0.0, 1.0);
  Joints q;
  for (int i = 0; i < kJoints; ++i) {
    q(i) = right_arm().min()(i) + share(random) * (right_arm().max()(i) - right_arm().min()(i));
  }
  return q;
}

TEST(ArmChain, EqualsTheRobotModelForBothArms) {
  const RobotModel model = RobotModel::load(NIDO_CONFIG_DIR "/robots/icub.urdf").value();
  std::mt19937_64 random(1);
  for (const std::string side : {"right", "left"}) {
    const ArmChain chain = ArmChain::from_model(model, side).value();
    const int torso = model.axis_index("torso_yaw").value();
    const int arm = model.axis_index(side.substr(0, 1) + "_shoulder_pitch").value();
    for (int i = 0; i < 20; ++i) {
      const Joints q = random_posture(random);
      Eigen::VectorXd axes = model.zero_axes();
      axes.segment<kTorsoJoints>(torso) = q.head<kTorsoJoints>();
      axes.segment<kArmJoints>(arm) = q.tail<kArmJoints>();
      const Eigen::Isometry3d expected = model.X_RootLink(model.hand(side)->frame, axes);
      EXPECT_LT((chain.X_RootPalm(q).matrix() - expected.matrix()).norm(), 1e-9);
    }
  }
  EXPECT_FALSE(ArmChain::from_model(model, "middle").ok());
}

// The mirror swaps left and right, and in the palm frame the sides of the palm.
TEST(ArmChain, TheLeftArmIsTheMirrorImageOfTheRight) {
  const RobotModel model = RobotModel::load(NIDO_CONFIG_DIR "/robots/icub.urdf").value();
  const ArmChain right = ArmChain::from_model(model, "right").value();
  const ArmChain left = ArmChain::from_model(model, "left").value();
  const Eigen::DiagonalMatrix<double, 3> mirror(1.0, -1.0, 1.0);
  const Eigen::DiagonalMatrix<double, 3> palm(1.0, 1.0, -1.0);
  std::mt19937_64 random(4);
  for (int i = 0; i < 20; ++i) {
    const Joints q = random_posture(random);
    Joints q_mirror = q;
    q_mirror(0) = -q(0);  // torso yaw and roll
    q_mirror(1) = -q(1);
    const Eigen::Isometry3d X = right.X_RootPalm(q);
    const Eigen::Isometry3d X_mirror = left.X_RootPalm(q_mirror);
    EXPECT_LT((X_mirror.translation() - mirror * X.translation()).norm(), 1e-4);
    EXPECT_LT((X_mirror.linear() - mirror * X.linear() * palm).norm(), 1e-3);
    const auto points = right.body_points(q);
    const auto points_mirror = left.body_points(q_mirror);
    ASSERT_EQ(points.size(), points_mirror.size());
    for (std::size_t p = 0; p < points.size(); ++p)
      EXPECT_LT((points_mirror[p].p_Root_m - mirror * points[p].p_Root_m).norm(), 2e-4);
  }
}

TEST(ArmChain, JacobianEqualsFiniteDifferences) {
  std::mt19937_64 random(2);
  const ArmChain chain = right_arm();
  const Joints q = random_posture(random);
  Jacobian jacobian;
  const Eigen::Isometry3d X = chain.X_RootPalm(q, jacobian);
  EXPECT_LT((X.matrix() - chain.X_RootPalm(q).matrix()).norm(), 1e-12);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < kJoints; ++i) {
    Joints moved = q;
    moved(i) += kStep;
    const Eigen::Isometry3d X_moved = chain.X_RootPalm(moved);
    EXPECT_LT(((X_moved.translation() - X.translation()) / kStep - jacobian.col(i).head<3>()).norm(), 1e-5);
    const Eigen::AngleAxisd turn(X_moved.linear() * X.linear().transpose());
    EXPECT_LT((turn.angle() * turn.axis() / kStep - jacobian.col(i).tail<3>()).norm(), 1e-4);
  }
}

TEST(InverseKinematics, FindsRandomPosesWithinTheLimits) {
  std::mt19937_64 random(3);
  const ArmChain chain = right_arm();
  const SeenOffset none = [](const Joints&) { return Eigen::Vector3d(0.003, -0.002, 0.004); };
  std::vector<Joints> starts;
  for (int i = 0; i < 12; ++i) starts.push_back(random_posture(random));
  SolverOptions options;
  options.rest = Joints::Zero();
  options.rest_weight = Joints::Constant(0.01);
  options.iterations = 150;
  int reached = 0;
  constexpr int kPoses = 100;
  for (int i = 0; i < kPoses; ++i) {
    const Joints truth = random_posture(random);
    PalmGoal goal;
    goal.X_RootPalm = chain.X_RootPalm(truth);
    goal.X_RootPalm.translation() += none(truth);
    goal.p_PalmTool_m = Eigen::Vector3d(0.05, 0.01, 0.03);
    const PalmSolution solution = solve_palm_from(chain, none, goal, starts, options);
    EXPECT_GE((solution.q - chain.min()).minCoeff(), 0.0);
    EXPECT_GE((chain.max() - solution.q).minCoeff(), 0.0);
    reached += solution.position_error_m < 0.002 && solution.turn_error_rad < 0.02 ? 1 : 0;
  }
  EXPECT_GE(reached, 85);  // poses at the very limits of several joints cannot be met with the margin
}

}  // namespace
}  // namespace nido::reach
