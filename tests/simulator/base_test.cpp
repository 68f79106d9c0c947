// What holds the robot's root: the world, a stand, or its own feet.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "robot_base.h"
#include "robot_tree.h"
#include "world_fixture.h"

namespace nido::sim {
namespace {

constexpr double kGravity_m_s2 = 9.81;
constexpr double kRobot_kg = 20.3;

SimulationOptions with_base(Base base) {
  SimulationOptions options = robot_only();
  options.base = base;
  return options;
}

double tilt_rad(const Simulation& sim) {
  const Eigen::Isometry3d X = sim.X_WorldLink("root_link").value();
  return std::acos(std::clamp(X.linear()(2, 2), -1.0, 1.0));
}

double floor_bears_N(const Simulation& sim) {
  double sum = 0;
  for (const ContactPair& pair : sim.contacts()) {
    if (pair.a_is_robot && pair.b == "floor") sum += pair.force_N;
  }
  return sum;
}

// A ball of five kilograms against the chest.
void push_over(Simulation& sim) {
  for (const char* line :
       {"world mk sph 0.1 0 1.0 1.0 1 0 0", "world mass sph 1 5", "world speed sph 1 0 0 -5"})
    ASSERT_EQ(sim.world(line), "[ok]");
}

TEST(FreeBase, stands_on_its_soles_with_its_weight) {
  const auto sim = make(with_base(Base::kFree));
  double most_rad = 0;
  for (int second = 0; second < 12; ++second) {
    ASSERT_TRUE(sim->step(1).ok());
    most_rad = std::max(most_rad, tilt_rad(*sim));
  }
  EXPECT_LT(most_rad, 0.005);
  const Eigen::Vector3d p_World_m = sim->X_WorldLink("root_link")->translation();
  EXPECT_LT(p_World_m.norm(), 0.003);
  EXPECT_NEAR(floor_bears_N(*sim), kRobot_kg * kGravity_m_s2, 0.005 * kRobot_kg * kGravity_m_s2);
  for (const ContactPair& pair : sim->contacts())
    EXPECT_TRUE(pair.a == "l_ankle_2" || pair.a == "r_ankle_2") << pair.a << " touches " << pair.b;
}

TEST(FreeBase, feels_itself_stand) {
  const auto sim = make(with_base(Base::kFree));
  ASSERT_TRUE(sim->step(5).ok());
  const Simulation::Inertial felt = sim->inertial();
  const Eigen::Vector3d up_World = felt.q_WorldSensor * felt.acceleration_m_s2;
  EXPECT_LT((up_World - Eigen::Vector3d(0, 0, kGravity_m_s2)).norm(), 0.1);
  EXPECT_LT(felt.angular_velocity_rad_s.norm(), 0.01);
  // each leg bears half of what is above its sensor: all but the legs beyond, which a hanging leg shows
  const auto hung = make(with_base(Base::kFixed));
  ASSERT_TRUE(hung->step(5).ok());
  for (const char* leg : {"left_leg", "right_leg"}) {
    const double weight_N = hung->force_torque(leg)->force_N.norm();
    EXPECT_NEAR(sim->force_torque(leg)->force_N.norm(), kRobot_kg * kGravity_m_s2 / 2 - weight_N,
                0.02 * kRobot_kg * kGravity_m_s2)
        << leg;
  }
  EXPECT_NEAR(sim->force_torque("left_arm")->force_N.norm(), hung->force_torque("left_arm")->force_N.norm(),
              0.1);
}

TEST(FreeBase, bends_its_knees_and_still_stands) {
  const auto sim = make(with_base(Base::kFree));
  const double bend_rad = 0.3;
  for (const char* leg : {"left_leg", "right_leg"}) {
    const int part = sim->part_index(leg);
    for (const int joint : {0, 3, 4})  // all three end together
      ASSERT_TRUE(sim->set_reference_speed(part, joint, joint == 3 ? 0.2 : 0.1).ok());
    ASSERT_TRUE(sim->command(part, JointMode::kPosition, std::array{0, 3, 4},
                             std::array{bend_rad, -2 * bend_rad, -bend_rad})
                    .ok());
  }
  ASSERT_TRUE(sim->step(10).ok());
  EXPECT_LT(tilt_rad(*sim), 0.1);
  // thigh and shank each lean by the bend
  EXPECT_NEAR(sim->X_WorldLink("root_link")->translation().z(), -(0.2236 + 0.213) * (1 - std::cos(bend_rad)),
              0.005);
  EXPECT_NEAR(floor_bears_N(*sim), kRobot_kg * kGravity_m_s2, 0.02 * kRobot_kg * kGravity_m_s2);
}

TEST(FreeBase, a_hard_push_tips_it_over_and_its_head_feels_that) {
  const auto sim = make(with_base(Base::kFree));
  ASSERT_TRUE(sim->step(1).ok());
  push_over(*sim);
  // what the head's gyroscope says, summed up, is how the head turned
  Eigen::Quaterniond q_WorldHead = sim->inertial().q_WorldSensor;
  double fastest_rad_s = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d before_rad_s = sim->inertial().angular_velocity_rad_s;
    ASSERT_TRUE(sim->step().ok());
    const Eigen::Vector3d w_rad_s = (before_rad_s + sim->inertial().angular_velocity_rad_s) / 2;
    fastest_rad_s = std::max(fastest_rad_s, w_rad_s.norm());
    const double angle_rad = w_rad_s.norm() * Simulation::kControlPeriod_s;
    if (angle_rad > 0)
      q_WorldHead = q_WorldHead * Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, w_rad_s.normalized()));
  }
  EXPECT_GT(tilt_rad(*sim), 1.2);
  EXPECT_GT(fastest_rad_s, 1.5);
  EXPECT_LT(q_WorldHead.angularDistance(sim->inertial().q_WorldSensor), 0.1);
  // gravity now pulls along another axis of the head
  ASSERT_TRUE(sim->step(2).ok());
  const Simulation::Inertial felt = sim->inertial();
  EXPECT_LT((felt.q_WorldSensor * felt.acceleration_m_s2 - Eigen::Vector3d(0, 0, kGravity_m_s2)).norm(), 0.2);
  EXPECT_LT(sim->X_WorldLink("root_link")->translation().z(), -0.4);
}

TEST(FreeBase, a_light_push_does_not) {
  const auto sim = make(with_base(Base::kFree));
  ASSERT_TRUE(sim->step(1).ok());
  for (const char* line :
       {"world mk sph 0.05 0 1.0 0.5 1 0 0", "world mass sph 1 0.2", "world speed sph 1 0 0 -1"})
    ASSERT_EQ(sim->world(line), "[ok]");
  ASSERT_TRUE(sim->step(5).ok());
  EXPECT_LT(tilt_rad(*sim), 0.02);
}

TEST(FreeBase, links_are_where_the_kinematics_puts_them_from_the_root) {
  const auto sim = make(with_base(Base::kFree));
  const auto fixed = make(with_base(Base::kFixed));
  ASSERT_TRUE(sim->step(1).ok());
  push_over(*sim);
  ASSERT_TRUE(sim->step(4).ok());
  ASSERT_GT(tilt_rad(*sim), 1.0);
  for (std::size_t part = 0; part < sim->parts().size(); ++part) {
    std::vector<double> angles_rad;
    for (std::size_t j = 0; j < sim->parts()[part].joints.size(); ++j) {
      const JointInfo& info = sim->parts()[part].joints[j];
      angles_rad.push_back(
          std::clamp(sim->joints(static_cast<int>(part))[j].position_rad, info.min_rad, info.max_rad));
    }
    ASSERT_TRUE(fixed->place_joints(static_cast<int>(part), angles_rad).ok());
  }
  const Eigen::Isometry3d X_WorldRoot = sim->X_WorldLink("root_link").value();
  for (const char* link : {"l_hand", "r_hand", "head", "l_foot", "chest"}) {
    const Eigen::Isometry3d expected = X_WorldRoot * fixed->X_WorldLink(link).value();
    const Eigen::Isometry3d found = sim->X_WorldLink(link).value();
    EXPECT_LT((expected.translation() - found.translation()).norm(), 0.002) << link;
    EXPECT_LT((expected.linear() - found.linear()).norm(), 0.01) << link;
  }
}

TEST(FreeBase, restore_and_reset_bring_the_root_back) {
  const auto sim = make(with_base(Base::kFree));
  const auto fresh = make(with_base(Base::kFree));
  ASSERT_TRUE(sim->step(0.5).ok());
  push_over(*sim);
  ASSERT_TRUE(sim->step(0.35).ok());  // in the fall
  ASSERT_EQ(sim->world("world snapshot falling"), "[ok]");
  std::vector<std::uint64_t> first;
  for (int i = 0; i < 150; ++i) {
    ASSERT_TRUE(sim->step().ok());
    first.push_back(sim->state_hash());
  }
  ASSERT_EQ(sim->world("world restore falling"), "[ok]");
  for (int i = 0; i < 150; ++i) {
    ASSERT_TRUE(sim->step().ok());
    ASSERT_EQ(sim->state_hash(), first[static_cast<std::size_t>(i)]) << "period " << i;
  }
  ASSERT_EQ(sim->world("world reset"), "[ok]");
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(sim->step().ok());
    ASSERT_TRUE(fresh->step().ok());
    ASSERT_EQ(sim->state_hash(), fresh->state_hash()) << "period " << i;
  }
}

TEST(FreeBase, its_snapshots_are_not_for_a_fixed_robot) {
  SimulationOptions options = with_base(Base::kFree);
  options.scene_folder = std::filesystem::path(::testing::TempDir()) / "nido_base_snapshots";
  ASSERT_EQ(make(options)->world("world snapshot free file"), "[ok]");
  EXPECT_EQ(make(options)->world("world restore free"), "[ok]");
  options.base = Base::kFixed;
  const std::string reply = make(options)->world("world restore free");
  EXPECT_NE(reply.find("another robot"), std::string::npos) << reply;
  std::filesystem::remove_all(options.scene_folder);
}

// Nothing touches it and nothing pulls: momentum and turning momentum stay, whatever the joints do.
TEST(FreeBase, in_free_flight_momentum_stays) {
  Result<RobotDescription> robot = read_robot(config("robots/icub.urdf"));
  ASSERT_TRUE(robot.ok());
  free_base(*robot);
  // no link lighter than those that the tree makes heavier, and no stops: they would be a push from outside
  for (LinkDescription& link : robot->links) {
    if (&link == robot->links.data() || link.freedom != Freedom::kHinge) continue;
    link.min_rad = -100;
    link.max_rad = 100;
    const double mass_kg = std::max(link.mass.mass_kg, 0.02);
    robot->links[kBaseDegrees].mass.mass_kg -= mass_kg - link.mass.mass_kg;
    link.mass.inertia_kgm2 *= mass_kg / link.mass.mass_kg;
    link.mass.mass_kg = mass_kg;
  }
  RobotTree tree(*robot);
  tree.set(1, 0, 0.3);
  tree.set(4, 0, 1.5);
  tree.set(5, 0, 4.0);
  tree.set(6, 0, -1.0);
  tree.update(0);
  const auto momenta = [&] {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    Eigen::Vector3d com = Eigen::Vector3d::Zero();
    for (std::size_t i = 1; i < tree.link_count(); ++i) {
      const MassProperties& mass = robot->links[i].mass;
      p += mass.mass_kg * tree.v_WorldCom_m_s(i);
      com += mass.mass_kg * tree.p_WorldCom_m(i) / kRobot_kg;
    }
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    for (std::size_t i = 1; i < tree.link_count(); ++i) {
      const MassProperties& mass = robot->links[i].mass;
      const Eigen::Matrix3d& R = tree.R_WorldLink(i);
      // the rotor that every hinge has
      const Eigen::Matrix3d inertia =
          mass.inertia_kgm2 + (i > kBaseDegrees ? 2e-5 : 0) * Eigen::Matrix3d::Identity();
      turn += (tree.p_WorldCom_m(i) - com).cross(mass.mass_kg * tree.v_WorldCom_m_s(i)) +
              R * inertia * R.transpose() * tree.w_World_rad_s(i);
    }
    return std::pair{p, turn};
  };
  const auto [p0, turn0] = momenta();
  const double step_s = 0.0005;
  for (int i = 0; i < 2000; ++i) {
    for (std::size_t link = kBaseDegrees + 1; link < tree.link_count(); ++link) {
      const double swing_rad_s = 0.5 * std::sin(3 * step_s * i + static_cast<double>(link));
      tree.set_motor(link, {.speed_rad_s = swing_rad_s, .most_torque_Nm = 1000});
    }
    tree.begin(0, step_s);
    for (int pass = 0; pass < 4; ++pass) {
      tree.solve(0);
      if (tree.settle(0, pass == 3)) break;
    }
    tree.advance(0, step_s);
  }
  const auto [p1, turn1] = momenta();
  EXPECT_GT(std::abs(tree.angle_rad(4)) + std::abs(tree.angle_rad(5)) + std::abs(tree.angle_rad(6)), 1);
  EXPECT_LT((p1 - p0).norm(), 0.02 * p0.norm());
  EXPECT_LT((turn1 - turn0).norm(), 0.02 * turn0.norm());
}

TEST(Stand, is_seen_and_touched_and_changes_no_motion) {
  const auto stand = make(with_base(Base::kStand));
  const auto fixed = make(with_base(Base::kFixed));
  const Result<ObjectState> seen = stand->object("stand");
  ASSERT_TRUE(seen.ok());
  EXPECT_TRUE(seen->is_static);
  SceneSnapshot scene;
  stand->scene(scene);
  EXPECT_EQ(std::count_if(scene.instances.begin(), scene.instances.end(),
                          [](const auto& instance) { return instance.name == "stand"; }),
            3);
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(stand->step().ok());
    ASSERT_TRUE(fixed->step().ok());
    ASSERT_EQ(stand->state_hash(), fixed->state_hash());
  }
  EXPECT_TRUE(stand->contacts().empty());
  // a ball rolls against the pole and stays on its side
  ASSERT_EQ(stand->world("world mk sph 0.04 0 0.3 -0.5 1 0 0"), "[ok]");
  ASSERT_EQ(stand->world("world speed sph 1 0 0 1"), "[ok]");
  bool touched = false;
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(stand->step().ok());
    for (const ContactPair& pair : stand->contacts())
      touched = touched || pair.a == "stand" || pair.b == "stand";
  }
  EXPECT_TRUE(touched);
  EXPECT_EQ(stand->world("world del all"), "[ok]");
  EXPECT_TRUE(stand->object("stand").ok());
}

TEST(Stand, stays_when_another_scene_is_loaded) {
  SimulationOptions options = with_base(Base::kStand);
  options.scene_folder = std::filesystem::path(::testing::TempDir()) / "nido_stand_scenes";
  const auto sim = make(options);
  ASSERT_EQ(sim->world("world load table"), "[ok]");
  EXPECT_TRUE(sim->object("stand").ok());
  ASSERT_EQ(sim->world("world save with_stand"), "[ok]");
  ASSERT_EQ(sim->world("world load with_stand"), "[ok]");
  EXPECT_EQ(sim->world("world num stand"), "1");
  std::filesystem::remove_all(options.scene_folder);
}

TEST(Stand, its_name_is_taken) {
  SimulationOptions options = with_base(Base::kStand);
  options.world_yaml = "objects:\n  - {object: cube, name: stand, position_m: [-0.3, 0, 0]}\n";
  const auto refused = Simulation::create(options);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("\"stand\""), std::string::npos) << refused.error().message;
}

}  // namespace
}  // namespace nido::sim
