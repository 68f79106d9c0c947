// Going back: the same state has the same future, bit for bit, here and in another process.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "grasp_trial.h"
#include "world_fixture.h"

namespace nido::sim {
namespace {

bool failed(const std::string& reply) { return reply.starts_with("[fail]"); }

std::vector<std::uint64_t> future(Simulation& sim, int periods) {
  std::vector<std::uint64_t> hashes;
  for (int i = 0; i < periods; ++i) {
    EXPECT_TRUE(sim.step().ok());
    hashes.push_back(sim.state_hash());
  }
  return hashes;
}

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

class WorldSnapshotTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::path(::testing::TempDir()) /
        (std::string("nido_snapshot_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] SimulationOptions options() const {
    SimulationOptions options = robot_only();
    options.scene_folder = folder_;
    return options;
  }

  // A busy moment: a cube in the fingers, an arm on its way, a stack, a push, faults, a weight, a dim room.
  [[nodiscard]] std::unique_ptr<Simulation> busy() const {
    SimulationOptions busy = options();
    busy.world_yaml =
        "table: {}\nobjects:\n  - {object: cube, name: thing, position_m: [-0.30, 0.06], yaw_deg: 25}\n"
        "  - {object: cube, name: low, position_m: [-0.45, -0.1]}\n"
        "  - {object: bear, name: teddy, position_m: [-0.45, -0.25]}\n";
    auto sim = make(busy);
    const Result<RobotModel> model = RobotModel::load(config("robots/icub.urdf"));
    const GraspResult held =
        try_grasp(*sim, ArmReach(*model), read_postures(config("robots/grasp_postures.yaml")).at("cube"),
                  {.object = "thing", .basket = "", .hold_s = 0.2});
    EXPECT_TRUE(held.hold.held()) << held.trouble;
    for (const char* line :
         {"world mk sph 0.03 0.1 0.9 0.45 1 0 0", "world mk cyl 0.02 0.1 0.2 0.6 0.4 0 1 0",
          "world mk sbox 0.1 0.02 0.1 -0.3 0.55 0.4 1 0.5 0 0", "world friction \"low\" 0.2",
          "world force low 1 0 0 0.5", "world mk box 0.02 0.1 0.02 0.6 1 0 0 0 1",
          "world joint ball box 1 world 0.62 1.05 0", "world mass teddy 0.31", "world light key 0.5",
          "world fault left_leg 3 off", "world fault skin right palm stuck", "world fault skin torso off",
          "world fault cam left noise"})
      EXPECT_EQ(sim->world(line), "[ok]") << line;
    const std::array<int, 3> joints = {0, 1, 3};
    EXPECT_TRUE(sim->command(sim->part_index("left_arm"), JointMode::kPosition, joints,
                             std::array<double, 3>{-0.7, 0.4, 1.1})
                    .ok());
    const std::array<int, 1> yaw = {0};
    EXPECT_TRUE(
        sim->command(sim->part_index("torso"), JointMode::kVelocity, yaw, std::array<double, 1>{0.05}).ok());
    EXPECT_TRUE(sim->step(0.2).ok());
    return sim;
  }

  std::filesystem::path folder_;
};

TEST_F(WorldSnapshotTest, the_same_state_has_the_same_future) {
  auto sim = busy();
  EXPECT_TRUE(sim->hold("thing")->held());
  ASSERT_EQ(sim->world("world snapshot"), "[ok]");
  const double time_s = sim->time_s();
  const std::vector<std::uint64_t> first = future(*sim, 150);
  EXPECT_NE(first.front(), first.back());
  ASSERT_EQ(sim->world("world restore"), "[ok]");
  EXPECT_GT(sim->time_s(), time_s) << "time goes on";
  EXPECT_EQ(future(*sim, 150), first);
  // also after things were made, deleted and moved, and from a reset
  for (const char* line : {"world del thing", "world mk box 0.1 0.1 0.1 0.3 0.6 0.3 1 0 0",
                           "world name teddy bruno", "world set low 0 1 0.5", "world reset"})
    ASSERT_EQ(sim->world(line), "[ok]") << line;
  ASSERT_TRUE(sim->step(0.3).ok());
  ASSERT_EQ(sim->world("world restore"), "[ok]");
  EXPECT_EQ(future(*sim, 150), first);
  EXPECT_TRUE(sim->hold("thing")->held());
}

// Its far side is the same test, told by the environment where the snapshot lies.
TEST_F(WorldSnapshotTest, another_process_goes_on_from_the_file) {
  if (const char* scenes = std::getenv("NIDO_TEST_SCENES"); scenes != nullptr) {
    SimulationOptions child = robot_only();
    child.scene_folder = scenes;
    auto sim = make(child);
    ASSERT_EQ(sim->world("world restore moment"), "[ok]");
    std::ofstream out(child.scene_folder / "future.txt");
    for (const std::uint64_t hash : future(*sim, 100)) out << hash << '\n';
    return;
  }
  auto sim = busy();
  ASSERT_EQ(sim->world("world snapshot moment file"), "[ok]");
  const std::vector<std::uint64_t> here = future(*sim, 100);
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  // the child has folders of its own: it must not sweep away what it is to read
  const std::string line =
      "NIDO_TEST_SCENES='" + folder_.string() + "' TEST_TMPDIR='" + folder_.string() + "' '" + self +
      "' --gtest_filter=WorldSnapshotTest.another_process_goes_on_from_the_file > /dev/null";
  ASSERT_EQ(std::system(line.c_str()), 0);
  std::ifstream in(folder_ / "future.txt");
  std::vector<std::uint64_t> there;
  for (std::uint64_t hash = 0; in >> hash;) there.push_back(hash);
  EXPECT_EQ(there, here);
}

// what can be asked is there at once, not only after a step
TEST_F(WorldSnapshotTest, who_touches_whom_comes_back) {
  auto sim = busy();
  const std::string questions[] = {"world contacts thing", "world touching thing", "world contacts low",
                                   "world touching teddy"};
  std::vector<std::string> before;
  for (const std::string& question : questions) before.push_back(sim->world(question));
  EXPECT_NE(before[0], "[ok]") << "the hand holds it";
  const HoldQuery held = *sim->hold("thing");
  const std::uint64_t moment = sim->moment();
  ASSERT_EQ(sim->world("world snapshot moment file"), "[ok]");
  const auto compare = [&](Simulation& other, const char* where) {
    EXPECT_EQ(other.moment(), moment) << where;
    for (std::size_t i = 0; i < before.size(); ++i)
      EXPECT_EQ(other.world(questions[i]), before[i]) << questions[i] << " " << where;
    EXPECT_EQ(other.hold("thing")->right, held.right) << where;
  };
  ASSERT_TRUE(sim->step(0.5).ok());
  ASSERT_EQ(sim->world("world reset"), "[ok]");
  ASSERT_EQ(sim->world("world restore moment"), "[ok]");
  compare(*sim, "in the same simulation");
  auto other = make(options());
  ASSERT_EQ(other->world("world restore moment"), "[ok]");
  compare(*other, "from the file");
}

TEST_F(WorldSnapshotTest, a_wrong_file_is_refused_and_changes_nothing) {
  auto sim = make(options());
  ASSERT_EQ(sim->world("world mk box 0.1 0.1 0.1 0.3 0.6 0.3 1 0 0"), "[ok]");
  ASSERT_EQ(sim->world("world snapshot good file"), "[ok]");
  const std::string good = read(folder_ / "good.snapshot.json");
  const std::uint64_t hash = sim->state_hash();
  const auto refused = [&](const std::string& text, const std::string& why) {
    std::ofstream(folder_ / "bad.snapshot.json") << text;
    const std::string reply = sim->world("world restore bad");
    EXPECT_TRUE(failed(reply)) << why << " -> " << reply;
    EXPECT_NE(reply.find("bad.snapshot.json"), std::string::npos) << reply;
    EXPECT_NE(reply.find(why), std::string::npos) << reply;
    EXPECT_EQ(sim->state_hash(), hash);
  };
  const auto with = [&good](const std::string& from, const std::string& to) {
    std::string changed = good;
    const std::size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? changed : changed.replace(at, from.size(), to);
  };
  refused("", "parse error");
  refused("[1, 2", "parse error");
  refused("{}", "no snapshot");
  refused(good.substr(0, good.size() / 2), "parse error");
  refused(with("nido snapshot 2", "nido snapshot 9"), "no snapshot");
  refused(with("\"neck_", "\"nick_"), "another robot");
  refused(with("\"friction\":1.0", "\"friction\":1e9"), "surface");
  refused(with("\"friction\":1.0", "\"friction\":1e999"), "out_of_range");
  refused(with("\"name\":\"box 1\"", "\"name\":\"\""), "name");
  refused(with("\"period\":0", "\"period\":-1"), "time");
  refused(with("\"drives\":", "\"drifes\":"), "drives");
  refused(with("\"touching\":[",
               "\"touching\":[{\"a\":{\"kind\":\"object\",\"index\":9},\"b\":{\"kind\":"
               "\"floor\",\"index\":0},\"robot_geom\":-1,\"robot_geom_b\":-1,\"p_World_m\":[0,0,0],"
               "\"depth_m\":0,\"force_N\":0}" +
                   std::string(good.find("\"touching\":[]") == std::string::npos ? "," : "")),
          "touches");
  for (const char* line :
       {"world restore never", "world restore ../good", "world restore \"\"", "world snapshot ../x file",
        "world snapshot a/b file", "world snapshot a fail", "world snapshot a file b"}) {
    EXPECT_TRUE(failed(sim->world(line))) << line;
  }
  EXPECT_EQ(sim->world("world restore good"), "[ok]");
}

}  // namespace
}  // namespace nido::sim
