// Body, drives, touch, repeatability.
#include "nido/simulator/simulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <numbers>
#include <random>
#include <thread>

#include "nido/kinematics/robot_model.h"
#include "world_fixture.h"

namespace nido::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// a lively scene: the arm pushes things about on the table
std::uint64_t push_about(Simulation& sim, double duration_s) {
  const int arm = sim.part_index("right_arm");
  const std::array<int, 4> joints = {0, 1, 2, 3};
  const std::array<double, 4> down = {-0.2, 0.1, 0.2, 0.9};
  const std::array<double, 4> away = {-0.5, 0.6, 0.0, 0.6};
  EXPECT_TRUE(sim.command(arm, JointMode::kPosition, joints, down).ok());
  for (const int joint : joints) EXPECT_TRUE(sim.set_reference_speed(arm, joint, 1.5).ok());
  {
    const Status moved = sim.step(duration_s / 2);
    EXPECT_TRUE(moved.ok()) << (moved.ok() ? "" : moved.error().message);
  }
  EXPECT_TRUE(sim.command(arm, JointMode::kPosition, joints, away).ok());
  {
    const Status moved = sim.step(duration_s / 2);
    EXPECT_TRUE(moved.ok()) << (moved.ok() ? "" : moved.error().message);
  }
  return sim.state_hash();
}

TEST(Simulation, has_the_joints_of_the_icub) {
  auto sim = make(robot_only());
  ASSERT_EQ(sim->parts().size(), 6U);
  const std::array<std::pair<const char*, std::size_t>, 6> parts = {
      {{"head", 6}, {"torso", 3}, {"left_arm", 16}, {"right_arm", 16}, {"left_leg", 6}, {"right_leg", 6}}};
  for (std::size_t p = 0; p < parts.size(); ++p) {
    EXPECT_EQ(sim->parts()[p].name, parts[p].first);
    EXPECT_EQ(sim->parts()[p].joints.size(), parts[p].second);
    EXPECT_EQ(sim->part_index(parts[p].first), static_cast<int>(p));
  }
  EXPECT_EQ(sim->part_index("tail"), -1);
  EXPECT_EQ(sim->parts()[1].joints[0].name, "torso_yaw");
  EXPECT_EQ(sim->parts()[3].joints[15].name, "r_pinky");
}

// no hands, no eyes, axes that are no z axes: another description is another robot
TEST(Simulation, another_urdf_is_another_robot) {
  SimulationOptions options;
  options.urdf_path = config("robots/arm.urdf");
  const auto sim = make(options);
  const auto model = RobotModel::load(options.urdf_path);
  ASSERT_TRUE(model.ok()) << model.error().message;
  EXPECT_FALSE(sim->has_hand(Hand::kLeft));
  EXPECT_FALSE(sim->has_eye(Eye::kRight));
  ASSERT_EQ(sim->parts().size(), 1U);
  const std::array<double, 3> target_rad = {0.8, -0.6, -0.9};
  ASSERT_TRUE(sim->command_all(0, JointMode::kPosition, target_rad).ok());
  ASSERT_TRUE(sim->step(5).ok());
  Eigen::Vector3d axes_rad;
  for (int j = 0; j < 3; ++j) {
    axes_rad[j] = sim->joints(0)[static_cast<std::size_t>(j)].position_rad;
    EXPECT_NEAR(axes_rad[j], target_rad[static_cast<std::size_t>(j)], 0.3 * kDegree) << j;
  }
  for (const char* link : {"upper", "lower", "tip"}) {
    const Eigen::Isometry3d wanted = model->X_RootLink(*model->link_index(link), axes_rad);
    const Eigen::Isometry3d simulated = *sim->X_WorldLink(link);
    EXPECT_LT((simulated.translation() - wanted.translation()).norm(), 1e-6) << link;
    EXPECT_LT(Eigen::AngleAxisd(simulated.linear().transpose() * wanted.linear()).angle(), 1e-6) << link;
  }
  for (const char* line : {"world palm left", "world get rhand"}) {
    EXPECT_EQ(sim->world(line), "[fail] \"hand not recognized\" \"this robot has no such hand\"") << line;
  }
  for (const char* line :
       {"world fault cam left stuck", "world fault skin left palm off", "world fault arm 1 weak"})
    EXPECT_EQ(sim->world(line), "[ok]") << line;
  SimulationOptions massless = options;  // its root, the post, has no mass
  massless.base = Base::kFree;
  const auto refused = Simulation::create(massless);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("a root with a mass"), std::string::npos) << refused.error().message;
  const auto other = make(options);
  ASSERT_TRUE(other->restore_snapshot(sim->snapshot(), "snapshot").ok());
  EXPECT_EQ(other->complete_hash(), sim->complete_hash());
}

TEST(Simulation, joints_that_are_no_hinges_are_refused_by_their_names) {
  std::ifstream file(config("robots/arm.urdf"));
  const std::string hinges{std::istreambuf_iterator<char>(file), {}};
  const std::string hinge = "type=\"revolute\"";
  const std::size_t first = hinges.find(hinge);
  ASSERT_NE(first, std::string::npos);
  for (const std::string type : {"prismatic", "continuous", "planar", "floating"}) {
    SimulationOptions options;
    options.urdf_path = std::filesystem::path(testing::TempDir()) / ("arm_" + type + ".urdf");
    std::string text = hinges;
    std::ofstream(options.urdf_path) << text.replace(first, hinge.size(), "type=\"" + type + "\"");
    const auto refused = Simulation::create(options);
    ASSERT_FALSE(refused.ok()) << type;
    EXPECT_NE(refused.error().message.find("is neither revolute nor fixed"), std::string::npos)
        << refused.error().message;
    const auto model = RobotModel::load(options.urdf_path);
    ASSERT_FALSE(model.ok()) << type;
    EXPECT_NE(model.error().message.find("is neither revolute nor fixed"), std::string::npos)
        << model.error().message;
    std::filesystem::remove(options.urdf_path);
  }
}

TEST(Simulation, runs_repeat_bit_for_bit_and_from_reset_and_restore) {
  auto first = make(with_world("table"));
  auto second = make(with_world("table"));
  const SavedState start = first->save();
  const std::uint64_t hash = push_about(*first, 1.2);
  EXPECT_EQ(push_about(*second, 1.2), hash);
  second->reset();
  EXPECT_EQ(second->time_s(), 0);
  EXPECT_EQ(push_about(*second, 1.2), hash);
  ASSERT_TRUE(first->restore(start).ok());
  EXPECT_EQ(push_about(*first, 1.2), hash);
}

TEST(Simulation, a_state_saved_in_contact_has_one_future) {
  auto sim = make(with_world("table"));
  push_about(*sim, 0.8);
  const SavedState middle = sim->save();
  EXPECT_TRUE(sim->step(0.3).ok());
  const std::uint64_t hash = sim->state_hash();
  ASSERT_TRUE(sim->restore(middle).ok());
  EXPECT_TRUE(sim->step(0.3).ok());
  EXPECT_EQ(sim->state_hash(), hash);
}

TEST(Simulation, refuses_states_of_other_simulations_and_other_objects) {
  auto sim = make(with_world("table"));
  auto other = make(with_world("table"));
  EXPECT_FALSE(sim->restore(other->save()).ok());
  const SavedState before = sim->save();
  EXPECT_EQ(sim->world("world del red ball"), "[ok]");
  EXPECT_FALSE(sim->restore(before).ok());
}

TEST(Simulation, threads_do_not_disturb_each_other) {
  std::uint64_t alone = 0;
  {
    auto sim = make(with_world("table"));
    alone = push_about(*sim, 0.4);
  }
  std::array<std::uint64_t, 2> hash{};
  std::vector<std::thread> threads;
  for (std::uint64_t& h : hash) {
    threads.emplace_back([&h] {
      auto sim = make(with_world("table"));
      h = push_about(*sim, 0.4);
    });
  }
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(hash[0], alone);
  EXPECT_EQ(hash[1], alone);
}

TEST(Simulation, links_stand_where_the_kinematics_says) {
  auto sim = make(with_world("table"));
  const auto model = RobotModel::load(config("robots/icub.urdf"));
  ASSERT_TRUE(model.ok());
  const int arm = sim->part_index("right_arm");
  const std::array<int, 7> joints = {0, 1, 2, 3, 4, 5, 6};
  const std::array<double, 7> target = {-0.9, 0.6, 0.4, 1.2, 0.5, -0.4, 0.2};
  ASSERT_TRUE(sim->command(arm, JointMode::kPosition, joints, target).ok());
  ASSERT_TRUE(sim->step(4.0).ok());
  std::map<std::string, std::vector<double>> angles;
  for (std::size_t p = 0; p < sim->parts().size(); ++p) {
    for (const JointState& j : sim->joints(static_cast<int>(p)))
      angles[sim->parts()[p].name].push_back(j.position_rad);
  }
  const Eigen::VectorXd axes = *model->axes_from_parts(angles);
  for (const char* link : {"r_hand", "l_hand", "head", "r_index_tip", "l_eye", "r_foot"}) {
    const Eigen::Isometry3d simulated = *sim->X_WorldLink(link);
    const Eigen::Isometry3d computed = model->X_RootLink(*model->link_index(link), axes);
    EXPECT_LT((simulated.translation() - computed.translation()).norm(), 0.0005) << link;
    EXPECT_LT(Eigen::AngleAxisd(Eigen::Matrix3d(simulated.linear().transpose() * computed.linear())).angle(),
              0.002)
        << link;
  }
  // the eye's frame is the camera's
  EXPECT_TRUE(sim->X_WorldCamera(Eye::kLeft).isApprox(*sim->X_WorldLink("l_eye"), 1e-12));
}

TEST(Drives, settle_within_a_third_of_a_degree) {
  auto sim = make(robot_only());
  std::mt19937 random(5);
  for (std::size_t p = 0; p < sim->parts().size(); ++p) {
    std::vector<double> target;
    for (const JointInfo& j : sim->parts()[p].joints) {
      const double u = 0.1 + 0.8 * static_cast<double>(random() % 1000) / 1000;
      target.push_back(j.min_rad + u * (j.max_rad - j.min_rad));
    }
    if (p == 1) target = {0.1, -0.1, 0.05};
    // the hands stay off the table
    if (p == 2 || p == 3) target[0] = -1.4;
    ASSERT_TRUE(sim->command_all(static_cast<int>(p), JointMode::kPosition, target).ok());
    for (std::size_t j = 0; j < target.size(); ++j) {
      ASSERT_TRUE(sim->set_reference_speed(static_cast<int>(p), static_cast<int>(j), 1.0).ok());
    }
  }
  ASSERT_TRUE(sim->step(9).ok());
  for (std::size_t p = 0; p < sim->parts().size(); ++p) {
    const auto joints = sim->joints(static_cast<int>(p));
    for (std::size_t j = 0; j < joints.size(); ++j) {
      EXPECT_NEAR(joints[j].position_rad, joints[j].target, 0.3 * kDegree) << sim->parts()[p].joints[j].name;
      EXPECT_TRUE(joints[j].motion_done) << sim->parts()[p].joints[j].name;
    }
  }
}

TEST(Drives, reference_speed_sets_the_duration) {
  auto sim = make(robot_only());
  const int head = sim->part_index("head");
  const std::array<int, 1> yaw = {2};
  ASSERT_TRUE(sim->set_reference_speed(head, 2, 0.5).ok());
  ASSERT_TRUE(sim->command(head, JointMode::kPosition, yaw, std::array<double, 1>{0.5}).ok());
  ASSERT_TRUE(sim->step(0.5).ok());
  EXPECT_NEAR(sim->joints(head)[2].position_rad, 0.25, 0.02) << "half the way at half the time";
  EXPECT_FALSE(sim->joints(head)[2].motion_done);
  ASSERT_TRUE(sim->step(0.6).ok());
  EXPECT_NEAR(sim->joints(head)[2].position_rad, 0.5, 0.005);
  EXPECT_TRUE(sim->joints(head)[2].motion_done);
}

TEST(Drives, limits_hold_under_random_commands) {
  auto sim = make(with_world("table"));
  std::mt19937 random(17);
  const auto even = [&random](double low, double high) {
    return low + (high - low) * static_cast<double>(random() % 10001) / 10000;
  };
  constexpr std::array<JointMode, 6> kModes = {JointMode::kIdle,     JointMode::kPosition, JointMode::kDirect,
                                               JointMode::kVelocity, JointMode::kTorque,   JointMode::kPwm};
  for (int round = 0; round < 60; ++round) {
    for (std::size_t p = 0; p < sim->parts().size(); ++p) {
      const auto joint = static_cast<int>(random() % sim->parts()[p].joints.size());
      const std::array<int, 1> joints = {joint};
      const std::array<double, 1> value = {even(-200, 200)};
      ASSERT_TRUE(sim->command(static_cast<int>(p), kModes[random() % kModes.size()], joints, value).ok());
    }
    ASSERT_TRUE(sim->step(0.05).ok());
    for (std::size_t p = 0; p < sim->parts().size(); ++p) {
      const auto states = sim->joints(static_cast<int>(p));
      for (std::size_t j = 0; j < states.size(); ++j) {
        const JointInfo& info = sim->parts()[p].joints[j];
        EXPECT_GT(states[j].position_rad, info.min_rad - 3 * kDegree)
            << info.name << " in " << to_string(states[j].mode);
        EXPECT_LT(states[j].position_rad, info.max_rad + 3 * kDegree)
            << info.name << " in " << to_string(states[j].mode);
        EXPECT_LT(std::abs(states[j].torque_Nm), 1.05 * info.max_torque_Nm + 0.5) << info.name;
      }
    }
  }
}

TEST(Drives, bad_commands_are_refused_and_change_nothing) {
  auto sim = make(robot_only());
  const std::uint64_t hash = sim->state_hash();
  const int arm = sim->part_index("left_arm");
  const std::array<int, 2> two = {0, 1};
  const std::array<int, 2> twice = {3, 3};
  const std::array<int, 1> none = {16};
  const std::array<int, 1> negative = {-1};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(sim->command(arm, JointMode::kDirect, two, std::array<double, 2>{0.1, nan}).ok());
  EXPECT_FALSE(sim->command(arm, JointMode::kVelocity, two, std::array<double, 2>{infinite, 0}).ok());
  EXPECT_FALSE(sim->command(arm, JointMode::kPosition, two, std::array<double, 1>{0.1}).ok());
  EXPECT_FALSE(sim->command(arm, JointMode::kPosition, twice, std::array<double, 2>{0.1, 0.2}).ok());
  EXPECT_FALSE(sim->command(arm, JointMode::kPosition, none, std::array<double, 1>{0.1}).ok());
  EXPECT_FALSE(sim->command(arm, JointMode::kPosition, negative, std::array<double, 1>{0.1}).ok());
  EXPECT_FALSE(sim->command(9, JointMode::kPosition, two, std::array<double, 2>{0.1, 0.1}).ok());
  EXPECT_FALSE(sim->command_all(arm, JointMode::kPosition, std::array<double, 3>{0, 0, 0}).ok());
  EXPECT_FALSE(sim->set_reference_speed(arm, 0, nan).ok());
  EXPECT_FALSE(sim->set_reference_speed(arm, 0, 0).ok());
  EXPECT_FALSE(sim->set_reference_speed(arm, 99, 1).ok());
  EXPECT_FALSE(sim->place_joints(arm, std::vector<double>(16, 9.0)).ok());
  EXPECT_FALSE(sim->step(nan).ok());
  EXPECT_FALSE(sim->step(-1).ok());
  for (const JointState& j : sim->joints(arm)) EXPECT_EQ(j.mode, JointMode::kPosition);
  EXPECT_EQ(sim->state_hash(), hash);
  const Status refused = sim->command(arm, JointMode::kDirect, two, std::array<double, 2>{0.1, nan});
  EXPECT_NE(refused.error().message.find("l_shoulder_roll"), std::string::npos) << "the joint is named";
}

TEST(Drives, an_idle_arm_falls_and_its_weight_is_measured_when_held) {
  auto sim = make(robot_only());
  const int arm = sim->part_index("right_arm");
  const std::array<int, 1> pitch = {0};
  ASSERT_TRUE(sim->command(arm, JointMode::kPosition, pitch, std::array<double, 1>{-1.5}).ok());
  ASSERT_TRUE(sim->step(3.5).ok());
  // the arm stretched forward weighs about 1.8 kg at 0.2 m
  EXPECT_LT(sim->joints(arm)[0].torque_Nm, -1.0);
  EXPECT_GT(sim->joints(arm)[0].torque_Nm, -8.0);
  const auto wrench = sim->force_torque("right_arm");
  ASSERT_TRUE(wrench.ok());
  EXPECT_NEAR(wrench->force_N.norm(), 9.81 * 1.6, 6) << "weight of what is beyond the sensor";
  ASSERT_TRUE(sim->command(arm, JointMode::kIdle, pitch, std::array<double, 1>{0}).ok());
  ASSERT_TRUE(sim->step(0.5).ok());
  EXPECT_GT(sim->joints(arm)[0].position_rad, -1.4) << "nothing holds it";
  EXPECT_FALSE(sim->force_torque("tail").ok());
}

TEST(Drives, velocity_mode_stops_at_the_limit) {
  auto sim = make(robot_only());
  const int head = sim->part_index("head");
  const std::array<int, 1> yaw = {2};
  ASSERT_TRUE(sim->command(head, JointMode::kVelocity, yaw, std::array<double, 1>{0.4}).ok());
  ASSERT_TRUE(sim->step(1).ok());
  EXPECT_NEAR(sim->joints(head)[2].velocity_rad_s, 0.4, 0.01);
  EXPECT_NEAR(sim->joints(head)[2].position_rad, 0.4, 0.02);
  ASSERT_TRUE(sim->step(3).ok());
  EXPECT_NEAR(sim->joints(head)[2].position_rad, sim->parts()[0].joints[2].max_rad, 0.5 * kDegree);
}

TEST(Sensors, inertial_feels_gravity) {
  auto sim = make(robot_only());
  ASSERT_TRUE(sim->step(0.2).ok());
  EXPECT_NEAR(sim->inertial().acceleration_m_s2.norm(), 9.81, 0.05);
  EXPECT_LT(sim->inertial().angular_velocity_rad_s.norm(), 0.01);
}

TEST(Sensors, a_pad_feels_what_it_touches_and_nothing_else) {
  auto sim = make(robot_only());
  ASSERT_TRUE(sim->step(0.1).ok());
  for (const bool on : sim->touch(Hand::kRight).on) EXPECT_FALSE(on);
  // a static ball pressed a millimetre into the palm, off the thumb; its skin lies 1 mm behind the palm
  // frame; port's frame
  const Eigen::Vector3d p =
      *sim->X_WorldLink("r_hand") * Eigen::Vector3d(-0.035, 0.022, -0.001 + 0.02 - 0.001);
  const auto line = "world mk ssph 0.02 " + std::to_string(-p.y()) + " " +
                    std::to_string(p.z() - Simulation::kFloorHeight_m) + " " +
                    std::to_string(-p.x() - 0.026) + " 1 0 0";
  ASSERT_EQ(sim->world(line), "[ok]") << line;
  ASSERT_TRUE(sim->step(0.1).ok());
  const HandTouch touch = sim->touch(Hand::kRight);
  EXPECT_TRUE(touch.on[5]);
  EXPECT_GT(touch.force_N[5], 0);
  for (std::size_t pad = 0; pad < 5; ++pad) EXPECT_FALSE(touch.on[pad]) << pad;
  for (const bool on : sim->touch(Hand::kLeft).on) EXPECT_FALSE(on);
  ASSERT_EQ(sim->world("world del all"), "[ok]");
  ASSERT_TRUE(sim->step(0.05).ok());
  EXPECT_FALSE(sim->touch(Hand::kRight).on[5]);
}

TEST(Simulation, says_what_is_wrong_with_its_files) {
  SimulationOptions options = robot_only();
  options.urdf_path = config("robots/nobody.urdf");
  auto missing = Simulation::create(options);
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().message.find("nobody.urdf"), std::string::npos);
  options = robot_only();
  options.solver_iterations = 5;
  EXPECT_FALSE(Simulation::create(options).ok());
  options = robot_only();
  options.physics_step_s = 0.003;
  EXPECT_FALSE(Simulation::create(options).ok());
}

}  // namespace
}  // namespace nido::sim
