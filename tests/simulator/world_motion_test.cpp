// The world port's verbs of properties, motion and going back; its help and its page.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "nido/simulator/simulation.h"
#include "shapes.h"
#include "world_fixture.h"
#include "world_verbs.h"

namespace nido::sim {
namespace {

bool failed(const std::string& reply) { return reply.starts_with("[fail]"); }

TEST(WorldMotion, properties_are_set_and_read) {
  auto sim = make(robot_only());
  EXPECT_EQ(sim->world("world mk box 0.1 0.1 0.1 1 1 0 1 0 0"), "[ok]");
  EXPECT_EQ(sim->world("world mk sbox 0.1 0.1 0.1 1.5 1 0 1 0 0"), "[ok]");
  EXPECT_EQ(sim->world("world density box 1"), "640.0");
  EXPECT_EQ(sim->world("world density box 1 1000"), "[ok]");
  EXPECT_EQ(sim->world("world mass box 1"), "1.0");
  EXPECT_EQ(sim->world("world restitution box 1 0.7"), "[ok]");
  EXPECT_EQ(sim->world("world restitution box 1"), "0.7");
  EXPECT_EQ(sim->world("world speed box 1 1 2 3 0.1 0.2 0.3"), "[ok]");
  EXPECT_EQ(sim->world("world speed box 1"), "1.0 2.0 3.0 0.1 0.2 0.3");
  for (const char* line :
       {"world density box 1 0", "world density box 1 nan", "world density sbox 1 100",
        "world restitution box 1 1.1", "world speed box 1 1 2", "world speed sbox 1 1 2 3",
        "world speed box 1 1e9 0 0", "world force box 1", "world force sbox 1 1 0 0",
        "world force box 1 inf 0 0", "world force box 1 1 0 0 -1", "world torque box 1 0 0",
        "world speed box 1 0 0 0 0 0 0 0", "world link nowhere", "world link r_hand 2"}) {
    EXPECT_TRUE(failed(sim->world(line))) << line << " -> " << sim->world(line);
  }
  EXPECT_EQ(sim->world("world speed box 1"), "1.0 2.0 3.0 0.1 0.2 0.3") << "a refused line changes nothing";
}

TEST(WorldMotion, a_force_at_a_point_turns) {
  const auto sim = make_yaml("");
  // a cube in the air: 0.64 kg, inertia m a^2 / 6
  ASSERT_EQ(sim->world("world mk box 0.1 0.1 0.1 0 2 1 1 0 0"), "[ok]");
  const double inertia_kgm2 = 0.64 * 0.01 / 6;
  ASSERT_EQ(sim->world("world force box 1 0 0 0.5 0.05 0.05 2 1"), "[ok]");
  ASSERT_TRUE(sim->step(0.05).ok());
  std::istringstream speed(sim->world("world speed box 1"));
  Eigen::Vector3d v;
  Eigen::Vector3d w;
  speed >> v.x() >> v.y() >> v.z() >> w.x() >> w.y() >> w.z();
  EXPECT_NEAR(v.z(), 0.5 * 0.05 / 0.64, 0.01 * v.z());
  EXPECT_NEAR(w.y(), -0.05 * 0.5 * 0.05 / inertia_kgm2, 0.01 * std::abs(w.y()));
  EXPECT_LT(std::abs(w.x()) + std::abs(w.z()), 0.01);
  // a file of before there were points is read too, and one of now comes back with its point
  ASSERT_EQ(sim->world("world force box 1 0 0 0.5 1 0.05 2 1"), "[ok]");
  std::string text = sim->snapshot();
  const auto other = make_yaml("");
  ASSERT_TRUE(other->restore_snapshot(text, "now").ok());
  ASSERT_TRUE(sim->step(0.1).ok());
  ASSERT_TRUE(other->step(0.1).ok());
  EXPECT_EQ(sim->state_hash(), other->state_hash());
  const std::size_t place = text.find("\"p_ComPoint_Body_m\":");
  ASSERT_NE(place, std::string::npos);
  text.erase(place, text.find(']', place) + 2 - place);
  ASSERT_TRUE(other->restore_snapshot(text, "before").ok());
}

TEST(WorldMotion, a_force_gives_its_impulse) {
  auto sim = make(robot_only());
  ASSERT_EQ(sim->world("world mk box 0.1 0.1 0.1 1 2 0 1 0 0"), "[ok]");
  ASSERT_EQ(sim->world("world mass box 1 2"), "[ok]");
  ASSERT_EQ(sim->world("world force box 1 0 0 4 0.25"), "[ok]");
  ASSERT_TRUE(sim->step(0.4).ok());
  // 4 N for 0.25 s on 2 kg, forward: against x of the root frame
  EXPECT_NEAR(sim->object("box 1")->v_World_m_s.x(), -0.5, 1e-6);
  ASSERT_EQ(sim->world("world torque box 1 0 0.01 0 0.1"), "[ok]");
  ASSERT_TRUE(sim->step(0.2).ok());
  const double inertia = 2.0 / 12 * 0.02;
  EXPECT_NEAR(sim->object("box 1")->w_World_rad_s.z(), 0.001 / inertia, 1e-4);
}

TEST(WorldMotion, a_snapshot_brings_everything_back_and_time_goes_on) {
  auto sim = make(with_world("table"));
  const int arm = sim->part_index("right_arm");
  const std::array<int, 1> elbow = {3};
  ASSERT_TRUE(sim->step(0.1).ok());
  ASSERT_TRUE(sim->command(arm, JointMode::kPosition, elbow, std::array<double, 1>{0.6}).ok());
  ASSERT_TRUE(sim->step(0.3).ok());
  const std::string before = sim->world("world list");
  const std::uint64_t hash = sim->state_hash();
  ASSERT_EQ(sim->world("world snapshot"), "[ok]");
  ASSERT_EQ(sim->world("world del \"blue cube\""), "[ok]");
  ASSERT_EQ(sim->world("world mk sph 0.05 0 1 0.3 1 0 0"), "[ok]");
  ASSERT_EQ(sim->world("world name \"red ball\" tomato"), "[ok]");
  ASSERT_TRUE(sim->step(0.5).ok());
  const double time_s = sim->time_s();
  ASSERT_EQ(sim->world("world restore"), "[ok]");
  EXPECT_EQ(sim->world("world list"), before);
  EXPECT_EQ(sim->state_hash(), hash);
  EXPECT_EQ(sim->time_s(), time_s);
  ASSERT_TRUE(sim->step(3).ok());
  EXPECT_NEAR(sim->joints(arm)[3].position_rad, 0.6, 0.01) << "the motion went on from where it was";
  EXPECT_TRUE(failed(sim->world("world restore never")));
  ASSERT_EQ(sim->world("world reset"), "[ok]");
  EXPECT_NE(sim->world("world list").find("blue cube"), std::string::npos);
  EXPECT_GT(sim->time_s(), time_s);
  for (int i = 0; i < 7; ++i) EXPECT_EQ(sim->world("world snapshot s" + std::to_string(i)), "[ok]");
  EXPECT_TRUE(failed(sim->world("world snapshot one_more")));
}

TEST(WorldMotion, link_gives_the_pose_of_any_link) {
  auto sim = make(robot_only());
  std::istringstream in(sim->world("world link r_index_tip"));
  std::array<double, 7> v{};
  for (double& x : v) ASSERT_TRUE(in >> x);
  EXPECT_LT((Eigen::Vector3d(v[0], v[1], v[2]) - sim->X_WorldLink("r_index_tip")->translation()).norm(),
            1e-5);
  EXPECT_NE(sim->world("world link").find("l_foot"), std::string::npos);
}

// meshes as people export them: flat, with holes, inside out, without end
TEST(WorldMotion, rough_meshes_are_things_or_refused) {
  const std::string folder = ::testing::TempDir();
  const auto write = [&folder](const std::string& name, const std::string& text) {
    std::ofstream(folder + "/" + name) << text;
  };
  const std::string corners = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\n";
  write("rough_flat.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n");
  write("rough_mixed.obj", corners + "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
  write("rough_open.obj", corners + "f 2 3 4\n");
  write("rough_line.obj", "v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nf 1 2 3\n");
  write("rough_empty.obj", "# nothing\n");
  write("rough_nan.obj", "v nan 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n");
  write("rough_huge.obj", "v 0 0 0\nv 1e30 0 0\nv 0 0.1 0\nf 1 2 3\n");
  auto sim = make(with_world("table"));
  ASSERT_EQ(sim->world("world set mdir " + folder), "[ok]");
  for (const char* name : {"flat", "mixed", "open"}) {
    const std::string reply =
        sim->world("world mk model rough_" + std::string(name) + ".obj none 0 0.8 0.35");
    EXPECT_EQ(reply, "[ok]") << name;
  }
  for (const char* name : {"empty", "nan", "huge"}) {
    const std::string reply =
        sim->world("world mk model rough_" + std::string(name) + ".obj none 0 0.8 0.35");
    EXPECT_TRUE(failed(reply)) << name << " -> " << reply;
  }
  const auto far = load_mesh(folder + "/rough_huge.obj", Eigen::Vector3d::Ones());
  ASSERT_FALSE(far.ok()) << "by whatever way it comes";
  EXPECT_NE(far.error().message.find("more than 10 km away"), std::string::npos) << far.error().message;
  EXPECT_FALSE(sim->world("world mk model rough_line.obj none 0 0.8 0.35").empty());
  ASSERT_TRUE(sim->step(1).ok()) << "none of them breaks the physics";
  EXPECT_EQ(sim->world("world del all"), "[ok]");
}

TEST(WorldMotion, a_crowd_is_bounded_and_moves) {
  auto sim = make(robot_only());
  int made = 0;
  for (int i = 0; i < 300; ++i) {
    const std::string kind = i % 3 == 0 ? "box 0.05 0.05 0.05" : i % 3 == 1 ? "sph 0.03" : "cyl 0.03 0.06";
    const std::string place = " " + std::to_string(1 + 0.02 * (i % 10)) + " " +
                              std::to_string(0.2 + 0.01 * i) + " " + std::to_string(0.02 * (i / 10));
    const std::string reply = sim->world("world mk " + kind + place + " 1 0 0");
    if (reply == "[ok]") {
      ++made;
    } else {
      EXPECT_TRUE(reply.starts_with("[fail] \"too many objects\"")) << reply;
    }
  }
  EXPECT_EQ(made, 297) << "99 of a kind";
  const Status done = sim->step(0.1);
  EXPECT_TRUE(done.ok()) << done.error().message;
}

// one table makes the help, and the reference on the page
TEST(WorldMotion, help_and_the_page_know_every_verb) {
  auto sim = make(robot_only());
  std::istringstream help(sim->world("world help"));
  std::string line;
  int verbs = 0;
  while (std::getline(help, line)) {
    if (!line.starts_with("world ")) continue;
    const std::string verb = line.substr(6, line.find_first_of(" :", 6) - 6);
    ++verbs;
    if (verb == "help") continue;
    const std::string one = sim->world("world help " + verb);
    EXPECT_TRUE(one.starts_with("world " + verb)) << one;
    const std::size_t example = one.find("\nexample: world " + verb);
    ASSERT_NE(example, std::string::npos) << one;
    if (verb == "save") continue;
    // the example is understood: it may name a thing that is not there
    const std::string reply = sim->world(one.substr(example + 10));
    EXPECT_EQ(reply.find("too few words"), std::string::npos) << reply;
    EXPECT_EQ(reply.find("too many words"), std::string::npos) << reply;
    EXPECT_EQ(reply.find("unrecognized command"), std::string::npos) << reply;
  }
  EXPECT_GE(verbs, 25);
  EXPECT_TRUE(failed(sim->world("world help dance")));
}

// The page's reference is the table's text. After a change of a verb, write it anew:
// NIDO_WRITE_DOCS=1 build/bin/test_simulator --gtest_filter=WorldMotion.the_page_is_made_from_the_table
TEST(WorldMotion, the_page_is_made_from_the_table) {
  const std::string path = config("../docs/world.md");
  std::ifstream file(path);
  std::string page((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::string begin = "<!-- verbs: made from the simulator's table -->\n";
  const std::string end = "<!-- end of the verbs -->";
  const std::size_t first = page.find(begin);
  const std::size_t last = page.find(end);
  ASSERT_TRUE(first != std::string::npos && last != std::string::npos);
  const std::size_t from = first + begin.size();
  if (std::getenv("NIDO_WRITE_DOCS") != nullptr) {
    page.replace(from, last - from, world_reference());
    std::ofstream(path) << page;
    return;
  }
  EXPECT_EQ(page.substr(from, last - from), world_reference());
}

}  // namespace
}  // namespace nido::sim
