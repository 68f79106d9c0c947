// Inverse kinematics of arms and of gaze: what is reachable is reached, and in time.

#include <time.h>

#include <algorithm>
#include <iostream>

#include "nido/kinematics/chain_solver.h"
#include "nido/kinematics/gaze_solver.h"
#include "support.h"

namespace nido {
namespace {

const std::vector<std::string> kTorso = {"torso_yaw", "torso_roll", "torso_pitch"};

std::vector<std::string> arm_axes(const std::string& side, bool with_torso) {
  std::vector<std::string> axes = with_torso ? kTorso : std::vector<std::string>();
  for (const char* joint : {"shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", "wrist_prosup",
                            "wrist_pitch", "wrist_yaw"}) {
    axes.push_back(side + "_" + joint);
  }
  return axes;
}

SerialChain arm(const RobotModel& model, const std::string& side) {
  auto chain = SerialChain::create(model, side + "_hand", arm_axes(side, true));
  EXPECT_TRUE(chain.ok()) << (chain ? "" : chain.error().message);
  return std::move(chain).value();
}

// computing time of this thread: what others do on this computer does not count
double cpu_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
}

double draw(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

Eigen::VectorXd home_of(const RobotModel& model, const std::vector<std::string>& axes) {
  Eigen::VectorXd q(static_cast<Eigen::Index>(axes.size()));
  for (std::size_t i = 0; i < axes.size(); ++i) {
    q[static_cast<Eigen::Index>(i)] = model.home_axes()[*model.axis_index(axes[i])];
  }
  return q;
}

TEST(SerialChain, AgreesWithTheModel) {
  const RobotModel model = test::icub();
  std::mt19937_64 random(3);
  for (const std::string side : {"l", "r"}) {
    const SerialChain chain = arm(model, side);
    const std::vector<std::string> names = arm_axes(side, true);
    std::vector<int> indices;
    for (const std::string& name : names) indices.push_back(*model.axis_index(name));
    for (int n = 0; n < 20; ++n) {
      const Eigen::VectorXd axes = test::random_axes(model, random);
      Eigen::VectorXd q(chain.size());
      for (Eigen::Index j = 0; j < q.size(); ++j) q[j] = axes[indices[static_cast<std::size_t>(j)]];
      Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, chain.size());
      const int tip = *model.link_index(side + "_hand");
      EXPECT_TRUE(chain.X_RootTip(q, jacobian).isApprox(model.X_RootLink(tip, axes), 1e-9));
      EXPECT_TRUE(jacobian.isApprox(model.jacobian(tip, axes, indices), 1e-9));
    }
  }
}

TEST(SerialChain, NamesWhatDoesNotFit) {
  const RobotModel model = test::icub();
  EXPECT_EQ(SerialChain::create(model, "no_link", kTorso).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(SerialChain::create(model, "r_hand", {"no_axis"}).error().code, ErrorCode::kNotFound);
  EXPECT_NE(SerialChain::create(model, "r_hand", kTorso).error().message.find("r_"), std::string::npos);
  EXPECT_FALSE(SerialChain::create(model, "l_eye", {"eyes_version"}).ok());
}

class Reaching : public testing::TestWithParam<bool> {};

TEST_P(Reaching, ReachablePosesAreReached) {
  const bool with_torso = GetParam();
  const RobotModel model = test::icub();
  const SerialChain chain = arm(model, "r");
  const Eigen::VectorXd home = home_of(model, arm_axes("r", true));
  std::mt19937_64 random(11);
  constexpr int kPoses = 1000;
  int reached = 0;
  std::vector<double> duration_ms;
  for (int n = 0; n < kPoses; ++n) {
    Eigen::VectorXd there = home;
    for (Eigen::Index j = with_torso ? 0 : 3; j < there.size(); ++j) {
      there[j] = draw(random, chain.lower_rad()[j] + 0.02, chain.upper_rad()[j] - 0.02);
    }
    ChainOptions options;
    options.locked.assign(static_cast<std::size_t>(chain.size()), false);
    for (std::size_t j = 0; j < 3; ++j) options.locked[j] = !with_torso;
    const double begin_ms = cpu_ms();
    const ChainSolution found = solve_chain(chain, {chain.X_RootTip(there)}, home, options);
    duration_ms.push_back(cpu_ms() - begin_ms);
    // told errors are true ones
    const Eigen::Isometry3d X = chain.X_RootTip(found.q_rad);
    const double off_m = (X.translation() - chain.X_RootTip(there).translation()).norm();
    EXPECT_NEAR(off_m, found.position_error_m, 1e-9);
    EXPECT_TRUE((found.q_rad.array() >= chain.lower_rad().array()).all());
    EXPECT_TRUE((found.q_rad.array() <= chain.upper_rad().array()).all());
    if (!with_torso) {
      EXPECT_TRUE(found.q_rad.head(3) == home.head(3));
    }
    constexpr double kDegree_rad = 0.0174533;
    reached += found.position_error_m < 0.002 && found.turn_error_rad < kDegree_rad ? 1 : 0;
  }
  std::sort(duration_ms.begin(), duration_ms.end());
  std::cout << (with_torso ? "torso and arm" : "arm") << ": " << reached << " of " << kPoses
            << " poses, planning p50 " << duration_ms[500] << " ms, p99 " << duration_ms[990] << " ms\n";
  EXPECT_GE(reached, 990);
}
INSTANTIATE_TEST_SUITE_P(Arm, Reaching, testing::Values(true, false));

TEST(Reaching, WhatIsOutOfReachIsComeNearTo) {
  const RobotModel model = test::icub();
  const SerialChain chain = arm(model, "r");
  const Eigen::VectorXd home = home_of(model, arm_axes("r", true));
  ChainGoal goal;
  goal.X_RootTip.translation() = Eigen::Vector3d(-2.0, 0.1, 0.1);
  goal.with_orientation = false;
  const ChainSolution found = solve_chain(chain, goal, home);
  EXPECT_TRUE(found.q_rad.allFinite());
  EXPECT_GT(found.position_error_m, 1.0);
  // stretched out towards it
  EXPECT_LT(chain.X_RootTip(found.q_rad).translation().x(), -0.4);
}

TEST(Gaze, PointsComeToTheMiddleOfBothImages) {
  const RobotModel model = test::icub();
  const PinholeCamera camera;
  const auto solver = GazeSolver::create(model, camera);
  ASSERT_TRUE(solver.ok()) << solver.error().message;
  std::mt19937_64 random(5);
  HeadAngles head = HeadAngles::Zero();
  int centred = 0;
  double worst_px = 0;
  std::vector<double> duration_ms;
  for (int n = 0; n < 200; ++n) {
    const Eigen::Vector3d p_Root_m(draw(random, -1.0, -0.25), draw(random, -0.4, 0.4),
                                   draw(random, -0.1, 0.6));
    const TorsoAngles torso(draw(random, -0.2, 0.2), draw(random, -0.1, 0.1), draw(random, -0.1, 0.3));
    const double begin_ms = cpu_ms();
    const GazeSolution found = solver->solve(p_Root_m, torso, head);
    duration_ms.push_back(cpu_ms() - begin_ms);
    head = found.head_rad;
    // by the cameras themselves
    Eigen::VectorXd axes = model.zero_axes();
    axes.segment<6>(model.parts()[static_cast<std::size_t>(*model.part_index("head"))].first_axis) = head;
    axes.segment<3>(model.parts()[static_cast<std::size_t>(*model.part_index("torso"))].first_axis) = torso;
    double off_px = 0;
    for (const char* eye : {"left", "right"}) {
      const Eigen::Isometry3d X = model.X_RootLink(*model.camera_link(eye), axes);
      const auto px = camera.project(X.inverse() * p_Root_m);
      off_px = std::max(off_px, px ? (*px - Eigen::Vector2d(camera.cx_px, camera.cy_px)).norm() : 1e3);
    }
    centred += off_px < 3 ? 1 : 0;
    worst_px = std::max(worst_px, off_px);
    if (off_px < 1) {
      EXPECT_LT((solver->p_RootFixation_m(torso, head) - p_Root_m).norm(), 0.15 * p_Root_m.norm() + 0.02);
    }
  }
  std::sort(duration_ms.begin(), duration_ms.end());
  std::cout << centred << " of 200 points within 3 px, worst " << worst_px << " px, solving p99 "
            << duration_ms[197] << " ms\n";
  EXPECT_GE(centred, 198);
}

TEST(Gaze, APixelIsAPointOnItsLineOfSight) {
  const RobotModel model = test::icub();
  const auto solver = GazeSolver::create(model, PinholeCamera{});
  ASSERT_TRUE(solver.ok());
  const TorsoAngles torso = TorsoAngles::Zero();
  HeadAngles head = HeadAngles::Zero();
  Eigen::VectorXd axes = model.zero_axes();
  const auto first = [&](const char* part) {
    return model.parts()[static_cast<std::size_t>(*model.part_index(part))].first_axis;
  };
  axes.segment<3>(first("torso")) = torso;
  const auto seen_m = [&](const Eigen::Vector2d& px, const HeadAngles& head_rad) -> Eigen::Vector3d {
    axes.segment<6>(first("head")) = head_rad;
    const Ray sight = ray_of_pixel(PinholeCamera{}, model.X_RootLink(*model.camera_link("left"), axes), px);
    return sight.origin_m + 0.5 * sight.direction;
  };
  const Eigen::Vector3d p_Root_m = seen_m({40, 200}, head);
  const GazeSolution found = solver->solve(p_Root_m, torso, head);
  EXPECT_LT(found.error_px, 3);
  EXPECT_LT((seen_m({160, 120}, found.head_rad) - p_Root_m).norm(), 0.03);
}

}  // namespace
}  // namespace nido
