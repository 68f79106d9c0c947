// The world port's verbs about whole scenes: save and load, join, light, seed, and faults on purpose.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "world_fixture.h"

namespace nido::sim {
namespace {

bool failed(const std::string& reply) { return reply.starts_with("[fail]"); }

void say(Simulation& sim, const std::string& line) { ASSERT_EQ(sim.world(line), "[ok]") << line; }

class WorldScene : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              (std::string("nido_scene_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::unique_ptr<Simulation> make_in_folder(const std::string& yaml) const {
    SimulationOptions options = robot_only();
    options.world_yaml = yaml;
    options.scene_folder = folder_;
    return make(options);
  }
  std::filesystem::path folder_;
};

TEST_F(WorldScene, a_saved_scene_comes_back) {
  auto sim = make_in_folder(
      "table: {}\nobjects:\n  - {object: bear, name: teddy, position_m: [-0.3, 0.1], yaw_deg: 30}\n");
  say(*sim, "world mk cyl 0.02 0.1 0.1 0.6 0.4 0 1 0");
  say(*sim, "world rot cyl 1 -90 10 20");
  say(*sim, "world mk sbox 0.1 0.1 0.1 -0.3 0.05 0.4 1 0.5 0 0");
  say(*sim, "world name sbox 1 \"a \\ block: #1\"");
  say(*sim, "world friction cyl 1 0.3");
  say(*sim, "world mass cyl 1 0.25");
  say(*sim, "world light fill 0.3");
  ASSERT_TRUE(sim->step(0.5).ok());
  const std::vector<ObjectState> before = sim->objects();
  say(*sim, "world save here");

  auto other = make_in_folder("");
  say(*other, "world load here");
  const std::vector<ObjectState> after = other->objects();
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(after[i].name, before[i].name);
    EXPECT_EQ(after[i].kind, before[i].kind);
    EXPECT_EQ(after[i].is_static, before[i].is_static);
    EXPECT_NEAR(after[i].mass_kg, before[i].mass_kg, 1e-9) << before[i].name;
    EXPECT_TRUE(after[i].X_WorldObject.isApprox(before[i].X_WorldObject, 1e-9)) << before[i].name;
    EXPECT_TRUE(after[i].size_m.isApprox(before[i].size_m, 1e-9)) << before[i].name;
  }
  EXPECT_EQ(other->world("world friction cyl 1"), "0.3");
  EXPECT_EQ(other->world("world light"), sim->world("world light"));
  // a reset comes back to what was loaded
  say(*other, "world del teddy");
  say(*other, "world reset");
  EXPECT_EQ(other->objects().size(), before.size());
  // and a run may begin with the file
  SimulationOptions options = robot_only();
  options.world_path = folder_ / "here.yaml";
  EXPECT_EQ(make(options)->world("world num all"), sim->world("world num all"));
  say(*other, "world load empty");
  EXPECT_EQ(other->world("world num all"), make(with_world("empty"))->world("world num all"))
      << "worlds that come with nido can be loaded too";
}

TEST_F(WorldScene, a_bad_file_changes_nothing_and_none_is_written_elsewhere) {
  auto sim = make_in_folder("table: {}\nobjects:\n  - {object: cube, name: cube, position_m: [-0.3, 0.1]}\n");
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ / "bad.yaml") << "objects:\n  - {kind: box, position_m: [0, 0, 1]}\n";
  std::ofstream(folder_ / "worse.yaml") << "objects: [{object: cube, kind: x, shapes: []";
  for (const char* line :
       {"world load nothing", "world load", "world load bad", "world load worse", "world load ../bad",
        "world load bad.yaml", "world load \"\"", "world save", "world save ../here", "world save /tmp/here",
        "world save a/b", "world save .", "world save x y"})
    EXPECT_TRUE(failed(sim->world(line))) << line;
  EXPECT_EQ(sim->objects().size(), 2U);
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& file : std::filesystem::directory_iterator(folder_)) ++files;
  EXPECT_EQ(files, 2U);
}

TEST_F(WorldScene, two_things_joined_move_as_one) {
  auto sim = make(robot_only());
  say(*sim, "world mk box 0.1 0.02 0.02 1 0.5 0 1 0 0");
  say(*sim, "world mk box 0.02 0.1 0.02 1 0.56 0 0 1 0");
  say(*sim, "world mk sbox 0.1 0.1 0.1 2 0.5 0 0 1 0");
  EXPECT_TRUE(failed(sim->world("world join box 1 box 1")));
  EXPECT_TRUE(failed(sim->world("world join box 1 sbox 1")));
  const double mass_kg = sim->objects()[0].mass_kg + sim->objects()[1].mass_kg;
  say(*sim, "world join box 1 box 2");
  ASSERT_EQ(sim->objects().size(), 2U);
  EXPECT_NEAR(sim->objects()[0].mass_kg, mass_kg, 1e-12);
  const Eigen::Vector3d size_m = sim->objects()[0].size_m;
  EXPECT_NEAR(size_m.maxCoeff(), 0.12, 1e-9);
  say(*sim, "world torque box 1 0 0 0.01 0.05");
  ASSERT_TRUE(sim->step(1.5).ok());
  EXPECT_LT(sim->objects()[0].X_WorldObject.translation().z(), Simulation::kFloorHeight_m + 0.15);
  EXPECT_TRUE(sim->objects()[0].size_m.isApprox(size_m)) << "nothing came off";
}

// a rod on a hinge is a physical pendulum: T = 2 pi sqrt(I / (m g l)), I about the hinge
TEST_F(WorldScene, a_rod_on_a_hinge_swings_as_it_should) {
  auto sim = make(robot_only());
  constexpr double kLength_m = 0.4;
  say(*sim, "world mk box 0.02 0.4 0.02 1 1 0 1 0 0");
  say(*sim, "world joint hinge box 1 world 1 1.2 0 0 0 1");
  say(*sim, "world speed box 1 0.1 0 0 0 0 0.5");  // the middle moves sideways as the rod turns
  int turns = 0;
  double last_s = 0;
  double first_s = 0;
  double before = 0;
  while (turns < 7 && sim->time_s() < 10) {
    ASSERT_TRUE(sim->step().ok());
    const double now = sim->object("box 1")->w_World_rad_s.x();
    if (now * before < 0) {
      ++turns;
      const double cross_s = sim->time_s() - 0.01 * now / (now - before);
      if (turns == 1) first_s = cross_s;
      last_s = cross_s;
    }
    before = now;
  }
  ASSERT_EQ(turns, 7);
  const double about_hinge = (kLength_m * kLength_m + 0.02 * 0.02) / 12 + 0.04;
  const double period_s = 2 * M_PI * std::sqrt(about_hinge / (9.81 * kLength_m / 2));
  EXPECT_NEAR((last_s - first_s) / 3, period_s, 0.01 * period_s);
  // its top stays at the hinge
  const ObjectState rod = *sim->object("box 1");
  const Eigen::Vector3d top = rod.X_WorldObject * Eigen::Vector3d(0, 0, 0.2);
  const Eigen::Vector3d other = rod.X_WorldObject * Eigen::Vector3d(0, 0.2, 0);
  const double hinge_z = 1.2 + Simulation::kFloorHeight_m;
  EXPECT_LT(std::min(std::abs(top.z() - hinge_z), std::abs(other.z() - hinge_z)), 0.001);
}

TEST_F(WorldScene, what_hangs_together_stays_together_and_is_saved) {
  auto sim = make_in_folder("");
  say(*sim, "world mk sbox 0.1 0.1 0.1 1 1.5 0 1 0 0");
  // a chain of three, and a weight that is fixed to its end
  for (int i = 0; i < 3; ++i)
    say(*sim, "world mk box 0.02 0.1 0.02 1 " + std::to_string(1.39 - 0.12 * i) + " 0 0 1 0");
  say(*sim, "world mk sph 0.03 1.1 1.15 0 1 1 0");
  say(*sim, "world joint ball box 1 sbox 1 1 1.45 0");
  say(*sim, "world joint ball box 2 box 1 1 1.33 0");
  say(*sim, "world joint ball box 3 box 2 1 1.21 0");
  say(*sim, "world joint fixed sph 1 box 3");
  const auto apart = [&](const std::string& a, const std::string& b) {
    return (sim->object(a)->X_WorldObject.inverse() * sim->object(b)->X_WorldObject).translation().eval();
  };
  const Eigen::Vector3d before = apart("box 3", "sph 1");
  ASSERT_TRUE(sim->step(3).ok());
  EXPECT_LT((apart("box 3", "sph 1") - before).norm(), 0.002) << "firmly";
  const Eigen::Vector3d p = sim->object("box 1")->X_WorldObject.translation();
  const Eigen::Vector3d base =
      sim->object("sbox 1")->X_WorldObject.translation() - Eigen::Vector3d(0, 0, 0.05);
  EXPECT_NEAR((p - base).norm(), 0.06, 0.002) << "it hangs on its point";
  for (const char* line : {"world joint ball box 1 box 1 0 0 0", "world joint hinge box 1 box 2 0 0 0 0 0 0",
                           "world joint hinge box 1 box 2 0 0 0", "world joint slide box 1 box 2",
                           "world joint none box 1 world", "world joint ball sbox 1 world 0 0 0",
                           "world joint ball box 1", "world joint fixed box 1 box 9"})
    EXPECT_TRUE(failed(sim->world(line))) << line;
  say(*sim, "world save chain");
  auto other = make_in_folder("");
  say(*other, "world load chain");
  const auto count = [](const std::string& text) { return std::count(text.begin(), text.end(), '('); };
  EXPECT_EQ(count(other->world("world joint")), 4);
  say(*other, "world del box 2");
  EXPECT_EQ(count(other->world("world joint")), 2) << "its joints go with it";
  ASSERT_TRUE(other->step(0.5).ok());
  say(*other, "world reset");
  EXPECT_EQ(count(other->world("world joint")), 4);
  say(*sim, "world joint none sph 1 box 3");
  ASSERT_TRUE(sim->step(1).ok());
  EXPECT_LT(sim->object("sph 1")->X_WorldObject.translation().z(), Simulation::kFloorHeight_m + 0.05)
      << "it fell off";
}

TEST_F(WorldScene, lines_about_time_are_for_the_owner_of_the_clock) {
  auto sim = make(robot_only());
  std::string request;
  const auto asks = [&](const std::string& line) {
    EXPECT_EQ(sim->world(line, &request), "[ok]") << line;
    return request;
  };
  EXPECT_EQ(asks("world time"), "get");
  EXPECT_EQ(asks("world pause"), "pause");
  EXPECT_EQ(asks("world go"), "run");
  EXPECT_EQ(asks("world step"), "step 1");
  EXPECT_EQ(asks("world step 0.5"), "step 50");
  EXPECT_EQ(asks("world rate 2.5"), "rate 2.5");
  EXPECT_EQ(asks("world rate max"), "rate max");
  for (const char* line : {"world rate 0", "world rate -1", "world rate fast", "world rate", "world step 0",
                           "world step nan", "world step 61", "world pause now", "world go 1"}) {
    EXPECT_TRUE(failed(sim->world(line, &request))) << line;
    EXPECT_EQ(request, "") << line;
  }
  EXPECT_NE(sim->world("world num all", &request), "");
  EXPECT_EQ(request, "");
  EXPECT_TRUE(failed(sim->world("world pause"))) << "nobody owns a clock";
}

TEST_F(WorldScene, light_is_set_read_and_seen) {
  auto sim = make(robot_only());
  SceneSnapshot scene;
  say(*sim, "world light brightness 0.4");
  say(*sim, "world light shadows 0");
  say(*sim, "world light direction 0 1 0");
  sim->scene(scene);
  EXPECT_DOUBLE_EQ(scene.light.brightness, 0.4);
  EXPECT_FALSE(scene.light.shadows);
  EXPECT_TRUE(scene.light.key_direction_World.isApprox(Eigen::Vector3d::UnitZ()));
  const std::string set = "brightness 0.4 key 1.0 fill 1.0 ambient 1.0 shadows 0 direction 0.0 1.0 0.0";
  EXPECT_EQ(sim->world("world light"), set);
  for (const char* line : {"world light brightness -1", "world light brightness nan", "world light moon 1",
                           "world light direction 0 0 0", "world light key", "world light shadows",
                           "world light shadows 2", "world light key 1 2"})
    EXPECT_TRUE(failed(sim->world(line))) << line;
  EXPECT_EQ(sim->world("world light"), set);
  say(*sim, "world reset");
  sim->scene(scene);
  EXPECT_EQ(scene.light, Lighting{});
}

TEST_F(WorldScene, a_seed_draws_another_table) {
  SimulationOptions options = with_world("random_table");
  options.seed = 3;
  auto sim = make(options);
  ASSERT_TRUE(sim->step(0.1).ok());
  const std::string third = sim->world("world list");
  const double time_s = sim->time_s();
  say(*sim, "world seed 4");
  EXPECT_NE(sim->world("world list"), third);
  EXPECT_EQ(sim->time_s(), time_s) << "time goes on";
  EXPECT_EQ(sim->world("world seed"), "4");
  options.seed = 4;
  EXPECT_EQ(make(options)->world("world list"), sim->world("world list"));
  for (const char* line : {"world seed 1.5", "world seed -1", "world seed x", "world seed 1 2"})
    EXPECT_TRUE(failed(sim->world(line))) << line;
}

TEST_F(WorldScene, faulty_joints_are_stuck_weak_or_off) {
  auto sim = make(robot_only());
  const int arm = sim->part_index("left_arm");
  const std::array<int, 3> joints = {0, 1, 3};
  const auto send = [&](double a, double b, double c) {
    ASSERT_TRUE(sim->command(arm, JointMode::kPosition, joints, std::array<double, 3>{a, b, c}).ok());
    ASSERT_TRUE(sim->step(4).ok());
  };
  say(*sim, "world fault left_arm 0 stuck");
  say(*sim, "world fault left_arm 3 off");
  const double stuck_rad = sim->joints(arm)[0].position_rad;
  send(-1, 0.5, 1.5);
  EXPECT_NEAR(sim->joints(arm)[0].position_rad, stuck_rad, 0.01);
  EXPECT_NEAR(sim->joints(arm)[1].position_rad, 0.5, 0.01) << "the others work";
  EXPECT_GT(std::abs(sim->joints(arm)[3].position_rad - 1.5), 0.2) << "nothing holds the forearm up";
  EXPECT_EQ(sim->world("world fault"), "(left_arm 0 stuck) (left_arm 3 off)");
  // a refused line changes nothing
  for (const char* line :
       {"world fault left_arm 16 off", "world fault left_arm 0.5 off", "world fault left_arm 0 tired",
        "world fault left_arm -1 off", "world fault tail 0 off", "world fault left_arm",
        "world fault left_arm 0", "world fault clear all"})
    EXPECT_TRUE(failed(sim->world(line))) << line;
  EXPECT_EQ(sim->world("world fault"), "(left_arm 0 stuck) (left_arm 3 off)");
  say(*sim, "world fault clear");
  EXPECT_EQ(sim->world("world fault"), "[ok]");
  send(-1, 0.5, 1.5);
  EXPECT_NEAR(sim->joints(arm)[0].position_rad, -1, 0.01);
  EXPECT_NEAR(sim->joints(arm)[3].position_rad, 1.5, 0.01);
}

// the eyes' version and vergence are sum and difference of two hinges
TEST_F(WorldScene, a_fault_of_one_joint_is_not_one_of_those_that_share_its_hinges) {
  for (const char* fault : {"stuck", "off"}) {
    for (const int faulty : {4, 5}) {
      auto sim = make(robot_only());
      const int head = sim->part_index("head");
      const std::array<int, 2> eyes = {4, 5};
      ASSERT_TRUE(sim->command(head, JointMode::kPosition, eyes, std::array<double, 2>{0.1, 0.2}).ok());
      ASSERT_TRUE(sim->step(1).ok());
      say(*sim, "world fault head " + std::to_string(faulty) + " " + fault);
      ASSERT_TRUE(sim->command(head, JointMode::kPosition, eyes, std::array<double, 2>{-0.2, 0.5}).ok());
      ASSERT_TRUE(sim->step(2).ok());
      const auto j = [&](int joint) {
        return sim->joints(head)[static_cast<std::size_t>(joint)].position_rad;
      };
      EXPECT_NEAR(j(4), faulty == 4 ? 0.1 : -0.2, 0.01) << fault << " " << faulty;
      EXPECT_NEAR(j(5), faulty == 5 ? 0.2 : 0.5, 0.01) << fault << " " << faulty;
      say(*sim, "world fault clear");
      ASSERT_TRUE(sim->step(1).ok());
      EXPECT_NEAR(j(faulty), faulty == 4 ? -0.2 : 0.5, 0.01) << fault << " is over";
    }
  }
}

// both hinges at once, as before
TEST_F(WorldScene, both_joints_of_shared_hinges_can_be_stuck) {
  auto sim = make(robot_only());
  const int head = sim->part_index("head");
  say(*sim, "world fault head 4 stuck");
  say(*sim, "world fault head 5 stuck");
  const std::array<int, 2> eyes = {4, 5};
  ASSERT_TRUE(sim->command(head, JointMode::kPosition, eyes, std::array<double, 2>{-0.2, 0.5}).ok());
  ASSERT_TRUE(sim->step(1).ok());
  EXPECT_NEAR(sim->joints(head)[4].position_rad, 0, 0.001);
  EXPECT_NEAR(sim->joints(head)[5].position_rad, 0, 0.001);
}

TEST_F(WorldScene, a_weak_joint_gives_a_fifth_of_its_torque) {
  auto sim = make(robot_only());
  const int arm = sim->part_index("left_arm");
  const std::array<int, 1> elbow = {3};
  const double most_Nm = sim->parts()[static_cast<std::size_t>(arm)].joints[3].max_torque_Nm;
  say(*sim, "world fault left_arm 3 weak");
  ASSERT_TRUE(sim->command(arm, JointMode::kPwm, elbow, std::array<double, 1>{1.0}).ok());
  ASSERT_TRUE(sim->step(0.02).ok());
  const double weak_Nm = sim->joints(arm)[3].torque_Nm;
  EXPECT_GT(weak_Nm, 0.1 * most_Nm);
  EXPECT_LE(weak_Nm, 0.2 * most_Nm + 1e-9);
}

TEST_F(WorldScene, faulty_skin_says_nothing_or_the_same) {
  // a static slab under the right hand: pushed into the palm it is felt
  auto sim = make(robot_only());
  const Eigen::Vector3d palm = sim->X_WorldLink("r_hand")->translation();
  const Eigen::Vector3d port = Eigen::Vector3d(-palm.y(), palm.z() + 0.5976, -palm.x() - 0.026);
  const std::string where =
      std::to_string(port.x()) + " " + std::to_string(port.y()) + " " + std::to_string(port.z());
  say(*sim, "world mk sbox 0.08 0.08 0.08 " + where + " 1 0 0");
  ASSERT_TRUE(sim->step(0.1).ok());
  const HandTouch felt = sim->touch(Hand::kRight);
  ASSERT_GT(std::count(felt.on.begin(), felt.on.end(), true), 0);
  say(*sim, "world fault skin right all stuck");
  say(*sim, "world del sbox 1");
  ASSERT_TRUE(sim->step(0.1).ok());
  EXPECT_EQ(sim->touch(Hand::kRight).on, felt.on) << "stuck: says what it said";
  say(*sim, "world fault skin right all none");
  ASSERT_TRUE(sim->step(0.1).ok());
  EXPECT_EQ(sim->touch(Hand::kRight).on, (std::array<bool, kPadCount>{}));
  say(*sim, "world fault skin right all off");
  say(*sim, "world mk sbox 0.08 0.08 0.08 " + where + " 1 0 0");
  ASSERT_TRUE(sim->step(0.1).ok());
  EXPECT_EQ(sim->touch(Hand::kRight).on, (std::array<bool, kPadCount>{})) << "off: says nothing";
  for (const char* line :
       {"world fault skin left elbow off", "world fault skin off", "world fault cam middle off",
        "world fault cam left off off", "world fault skin left palm weak"})
    EXPECT_TRUE(failed(sim->world(line))) << line;
  say(*sim, "world fault cam left slow");
  EXPECT_EQ(sim->camera_fault(Eye::kLeft), CameraFault::kSlow);
  EXPECT_EQ(sim->camera_fault(Eye::kRight), CameraFault::kNone);
  say(*sim, "world reset");
  EXPECT_EQ(sim->world("world fault"), "[ok]");
  EXPECT_EQ(sim->camera_fault(Eye::kLeft), CameraFault::kNone);
}

}  // namespace
}  // namespace nido::sim
