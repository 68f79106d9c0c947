// The world: files, physics of things, text vocabulary.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <sstream>

#include "nido/simulator/simulation.h"
#include "world_fixture.h"

namespace nido::sim {
namespace {

constexpr double kTable_m = -0.0826;

std::vector<double> numbers(const std::string& text) {
  std::istringstream in(text);
  std::vector<double> values;
  double v = 0;
  while (in >> v) values.push_back(v);
  return values;
}

bool failed(const std::string& reply) { return reply.starts_with("[fail]"); }

TEST(World, a_stack_stands) {
  auto sim = make_yaml(
      "table: {}\nobjects:\n"
      "  - {object: cube, name: low, position_m: [-0.45, 0.0, -0.0576]}\n"
      "  - {object: cube, name: middle, position_m: [-0.452, 0.002, -0.0076], yaw_deg: 10}\n"
      "  - {object: cube, name: high, position_m: [-0.449, 0.0, 0.0424], yaw_deg: 40}\n");
  ASSERT_TRUE(sim->step(3).ok());
  double height = kTable_m + 0.025;
  for (const char* name : {"low", "middle", "high"}) {
    EXPECT_NEAR(sim->object(name)->X_WorldObject.translation().z(), height, 0.002) << name;
    height += 0.05;
  }
}

TEST(World, a_dropped_cube_lies_in_the_basket) {
  auto sim = make_yaml(
      "table: {}\nobjects:\n"
      "  - {object: basket, name: basket, position_m: [-0.45, 0.0]}\n"
      "  - {object: cube, name: in, position_m: [-0.44, 0.02, 0.1], rpy_deg: [20, 30, 10]}\n"
      "  - {object: cube, name: out, position_m: [-0.45, 0.2]}\n"
      "  - {object: ball, name: above, position_m: [-0.45, 0.0, 0.4]}\n");
  EXPECT_FALSE(*sim->is_inside("above", "basket")) << "it is still in the air";
  ASSERT_TRUE(sim->step(2).ok());
  EXPECT_TRUE(*sim->is_inside("in", "basket"));
  EXPECT_TRUE(*sim->is_inside("above", "basket"));
  EXPECT_FALSE(*sim->is_inside("out", "basket"));
  EXPECT_FALSE(sim->is_inside("nothing", "basket").ok());
  EXPECT_TRUE(sim->hold("in")->world);
  EXPECT_FALSE(sim->hold("in")->held());
}

TEST(World, friction_decides_on_a_slope) {
  // a static slab tilted by 20 degrees: slides below 0.36
  auto sim = make(robot_only());
  ASSERT_EQ(sim->world("world mk sbox 0.6 0.02 0.6 0 0.5 1.5 1 1 1"), "[ok]");
  ASSERT_EQ(sim->world("world rot sbox 1 20 0 0"), "[ok]");
  ASSERT_EQ(sim->world("world mk box 0.05 0.05 0.05 0.1 0.537 1.5 1 0 0"), "[ok]");
  ASSERT_EQ(sim->world("world mk box 0.05 0.05 0.05 -0.1 0.537 1.5 0 0 1"), "[ok]");
  for (const int n : {1, 2}) ASSERT_EQ(sim->world("world rot box " + std::to_string(n) + " 20 0 0"), "[ok]");
  ASSERT_EQ(sim->world("world friction box 2 0.01"), "[ok]");
  ASSERT_TRUE(sim->step(0.3).ok());
  const std::vector<double> rough0 = numbers(sim->world("world get box 1"));
  const std::vector<double> smooth0 = numbers(sim->world("world get box 2"));
  ASSERT_TRUE(sim->step(0.7).ok());
  const std::vector<double> rough = numbers(sim->world("world get box 1"));
  const std::vector<double> smooth = numbers(sim->world("world get box 2"));
  EXPECT_LT(std::hypot(rough[1] - rough0[1], rough[2] - rough0[2]), 0.005);
  EXPECT_GT(std::hypot(smooth[1] - smooth0[1], smooth[2] - smooth0[2]), 0.1);
}

TEST(World, uses_the_old_frame) {
  auto sim = make(with_world("table"));
  const Eigen::Vector3d p = sim->object("red ball")->X_WorldObject.translation();
  const std::vector<double> port = numbers(sim->world("world get \"red ball\""));
  ASSERT_EQ(port.size(), 3U);
  EXPECT_NEAR(p.x(), -port[2] - 0.026, 1e-5);
  EXPECT_NEAR(p.y(), -port[0], 1e-5);
  EXPECT_NEAR(p.z(), port[1] - 0.5976, 1e-5);
}

struct Line {
  const char* text;
  const char* reply;  // exact, or the beginning when it ends with *
};

void expect_replies(Simulation& sim, const std::vector<Line>& lines) {
  for (const Line& line : lines) {
    const std::string reply = sim.world(line.text);
    std::string expected = line.reply;
    if (expected.ends_with('*')) {
      expected.pop_back();
      EXPECT_EQ(reply.substr(0, expected.size()), expected) << line.text << " -> " << reply;
    } else {
      EXPECT_EQ(reply, expected) << line.text;
    }
  }
}

TEST(WorldPort, answers_every_verb) {
  auto sim = make(robot_only());
  expect_replies(*sim, {
                           {"world mk box 0.1 0.2 0.3 0.1 1 2 1 0 0", "[ok]"},
                           {"world mk sbox 0.1 0.2 0.3 -1 1 2 1 0 0 1", "[ok]"},
                           {"world mk cyl 0.1 0.2 0.5 1 2 0 1 0 0", "[ok]"},
                           {"world mk scyl 0.1 0.2 1.5 1 2 0 1 0 false", "[ok]"},
                           {"world mk sph 0.1 2.5 1 2 0 0 1 true", "[ok]"},
                           {"world mk ssph 0.1 3.5 1 2 0 0 1", "[ok]"},
                           {"world num box", "1"},
                           {"world num sbox", "1"},
                           {"world num all", "6"},
                           {"world get box 1", "0.1 1.0 2.0"},
                           {"world set box 1 0.2 1.5 2", "[ok]"},
                           {"world get box 1", "0.2 1.5 2.0"},
                           {"world rot box 1 10 20 30", "[ok]"},
                           {"world rot box 1", "10.0 20.0 30.0"},
                           {"world rot sph 1 -100 -60 170", "[ok]"},
                           {"world rot sph 1", "-100.0 -60.0 170.0"},
                           {"world col sph 1", "0.0 0.0 1.0"},
                           {"world col sph 1 0.5 0.25 1", "[ok]"},
                           {"world col sph 1", "0.5 0.25 1.0"},
                           {"world name sph 1 \"my ball\"", "[ok]"},
                           {"world get my ball", "2.5 1.0 2.0"},
                           {"world mass \"my ball\" 0.25", "[ok]"},
                           {"world mass \"my ball\"", "0.25"},
                           {"world friction box 1 0.7", "[ok]"},
                           {"world friction box 1", "0.7"},
                           {"world touching box 1", "0 0"},
                           {"world inside box 1 sbox 1", "0"},
                           {"world contacts box 1", "[ok]"},
                           {"world get lhand", "*"},
                           {"world palm right", "*"},
                           {"world del box 1", "[ok]"},
                           {"world num box", "0"},
                           {"world del all", "[ok]"},
                           {"world num all", "0"},
                           {"world list", "[ok]"},
                           {"help", "OBJECT*"},
                           {"world help", "OBJECT*"},
                       });
}

TEST(WorldPort, refuses_in_words_and_changes_nothing) {
  auto sim = make(with_world("table"));
  const std::string before = sim->world("world list");
  const std::uint64_t hash = sim->state_hash();
  expect_replies(
      *sim,
      {
          {"", "[fail] \"unrecognized command\"*"},
          {"word mk box", "[fail] \"unrecognized command\"*"},
          {"world", "[fail] \"unrecognized command\"*"},
          {"world make box 1 1 1 0 1 0 1 1 1", "[fail] \"unrecognized command\"*"},
          {"world mk", "[fail] \"too few words\"*"},
          {"world mk cone 1 1 0 1 0 1 1 1", "[fail] \"unrecognized object type\"*"},
          {"world mk box 0 0.1 0.1 0 1 0 1 1 1", "[fail] \"could not set size\" \"size x is 0.0*"},
          {"world mk box 1e308 0.1 0.1 0 1 0 1 1 1", "[fail] \"could not set size\" \"size x is 1e+308;*"},
          {"world mk box 0.1 -0.1 0.1 0 1 0 1 1 1", "[fail] \"could not set size\" \"size y is -0.1*"},
          {"world mk box 0.1 0.1 1e30 0 1 0 1 1 1", "[fail] \"could not set size\"*"},
          {"world mk box 0.1 0.1 nan 0 1 0 1 1 1", "[fail] \"could not set size\" \"size z is 'nan'*"},
          {"world mk box 0.1 0.1 0.1 inf 1 0 1 1 1", "[fail] \"could not set location\"*"},
          {"world mk box 0.1 0.1 0.1 0 1e9 0 1 1 1", "[fail] \"could not set location\"*"},
          {"world mk box 0.1 0.1 0.1 0 1 0 1 1 2", "[fail] \"could not set color\"*"},
          {"world mk box 0.1 0.1 0.1 0 1 0 1 1", "[fail] \"could not set color\" \"colour z is missing*"},
          {"world mk box 0.1 0.1 0.1 0 1 0 1 1 1 2", "[fail] \"could not set collide\"*"},
          {"world mk box 0.1 0.1 0.1 0 1 0 1 1 1 1 7", "[fail] \"too many words\"*"},
          {"world mk sph 0 0 1 0 1 1 1", "[fail] \"could not set radius\"*"},
          {"world mk cyl 0.1 0 0 1 0 1 1 1", "[fail] \"could not set length\"*"},
          {"world mk model nothing.stl none 0 1 0", "[fail] \"Check spelling and location of model file\"*"},
          {"world get box", "[fail] \"could not set index\"*"},
          {"world get box 0", "[fail] \"could not set index\"*"},
          {"world get box 1.5", "[fail] \"could not set index\"*"},
          {"world get box 99", "[fail] \"out of range\"*"},
          {"world get green elephant", "[fail] \"unrecognized object type\"*"},
          {"world get screen", "[fail] \"could not get screen\"*"},
          {"world set screen 0 0 0", "[fail] \"could not set screen\"*"},
          {"world set red ball 0 nan 0", "[fail] \"could not set location\"*"},
          {"world set red ball 0 1", "[fail] \"could not set location\"*"},
          {"world set mdir /nowhere/at/all", "[fail] \"could not set model directory\"*"},
          {"world rot red ball 1 2", "[fail] \"could not set rotation\"*"},
          {"world rot red ball 1 2 inf", "[fail] \"could not set rotation\"*"},
          {"world col red ball 1 2 3", "[fail] \"could not set color\"*"},
          {"world num dragons", "[fail] \"unrecognized object type\"*"},
          {"world del", "[fail] \"too few words\"*"},
          {"world del red balloon", "[fail] \"unrecognized object type\"*"},
          {"world grab red ball right 1",
           "[fail] \"right hand must be disabled, cannot use grab with fingers\"*"},
          {"world grab red ball middle 1", "[fail] \"hand not recognized\"*"},
          {"world name red ball \"blue cube\"", "[fail] \"could not set name\"*"},
          {"world mass red ball -1", "[fail] \"could not set mass\"*"},
          {"world mass table 1 5", "[fail] \"could not set mass\"*"},
          {"world friction red ball -1", "[fail] \"could not set friction\"*"},
          {"world inside red ball", "[fail] \"too few words\"*"},
          {"world palm up", "[fail] \"hand not recognized\"*"},
          {"world get \"red ball", "[fail] \"cannot read the line\" \"a quote is not closed\""},
          {"world get \x01", "[fail] \"cannot read the line\"*"},
      });
  EXPECT_TRUE(failed(sim->world(std::string(5000, 'x'))));
  EXPECT_EQ(sim->world("world list"), before);
  EXPECT_EQ(sim->state_hash(), hash);
}

TEST(WorldPort, survives_any_text) {
  auto sim = make(with_world("table"));
  std::mt19937 random(99);
  const std::vector<std::string> words = {
      "world",  "mk",       "get",          "set",   "rot",      "col",    "del",      "num",    "name",
      "mass",   "friction", "list",         "where", "touching", "inside", "contacts", "palm",   "grab",
      "box",    "sbox",     "sph",          "cyl",   "scyl",     "smod",   "model",    "basket", "table",
      "red",    "ball",     "\"red ball\"", "1",     "2",        "0",      "-1",       "0.05",   "1e300",
      "-1e300", "1e-300",   "nan",          "inf",   "0x10",     "all",    "left",     "right",  "(",
      ")",      "\"",       "mdir",         "..",    "\t",       "true",   "0.5",      "0.6",    "0.3"};
  int steps = 0;
  for (int i = 0; i < 4000; ++i) {
    std::string line = random() % 8 == 0 ? "" : "world";
    const std::size_t count = random() % 13;
    for (std::size_t w = 0; w < count; ++w) line += " " + words[random() % words.size()];
    if (random() % 20 == 0) {
      for (int c = 0; c < 12; ++c) line += static_cast<char>(random() % 256);
    }
    EXPECT_FALSE(sim->world(line).empty()) << line;
    // things made on the way, however they lie, do not break the physics
    if (i % 100 == 0) {
      const Status done = sim->step(0.02);
      ASSERT_TRUE(done.ok()) << done.error().message;
      ++steps;
    }
  }
  EXPECT_GT(steps, 30);
}

TEST(World, things_made_inside_each_other_come_apart) {
  auto sim = make(robot_only());
  for (int i = 0; i < 6; ++i) ASSERT_EQ(sim->world("world mk box 0.1 0.1 0.1 0 0.3 1.5 1 0 0"), "[ok]");
  ASSERT_EQ(sim->world("world mk sph 0.05 0 0.3 1.5 1 0 0"), "[ok]");
  ASSERT_EQ(sim->world("world mk cyl 0.05 0.1 0 0.3 1.5 1 0 0"), "[ok]");
  const Status done = sim->step(3);
  ASSERT_TRUE(done.ok()) << done.error().message;
  for (const ObjectState& o : sim->objects()) {
    EXPECT_TRUE(o.X_WorldObject.matrix().allFinite());
    EXPECT_LT(o.X_WorldObject.translation().norm(), 10) << o.name << " was shot away";
    EXPECT_GT(o.X_WorldObject.translation().z(), Simulation::kFloorHeight_m - 0.02)
        << o.name << " fell through the floor";
  }
}

TEST(World, random_tables_have_target_distractors_and_basket_apart) {
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    SimulationOptions options = with_world("random_table");
    options.seed = seed;
    options.target = "red ball";
    auto sim = make(options);
    const std::vector<ObjectState> things = sim->objects();
    ASSERT_TRUE(sim->object("red ball").ok());
    ASSERT_TRUE(sim->object("basket").ok());
    EXPECT_GE(things.size(), 1U + 1U + 1U + 3U) << "table, basket, target, three distractors";
    const Eigen::Vector3d p = sim->object("red ball")->X_WorldObject.translation();
    EXPECT_GE(p.x(), -0.38);
    EXPECT_LE(p.x(), -0.26);
    for (const ObjectState& a : things) {
      for (const ObjectState& b : things) {
        if (a.name >= b.name || a.kind == "table" || b.kind == "table") continue;
        EXPECT_GT((a.X_WorldObject.translation() - b.X_WorldObject.translation()).head<2>().norm(), 0.07)
            << a.name << " and " << b.name << " at seed " << seed;
      }
    }
  }
}

TEST(World, random_tables_follow_the_seed) {
  SimulationOptions options = with_world("random_table");
  options.seed = 4;
  const std::string first = make(options)->world("world list");
  EXPECT_EQ(make(options)->world("world list"), first);
  options.seed = 5;
  EXPECT_NE(make(options)->world("world list"), first);
}

TEST(World, a_random_table_is_at_rest) {
  SimulationOptions options = with_world("random_table");
  options.seed = 3;
  auto sim = make(options);
  std::map<std::string, Eigen::Vector3d> start;
  for (const ObjectState& o : sim->objects()) start[o.name] = o.X_WorldObject.translation();
  ASSERT_TRUE(sim->step(2).ok());
  for (const ObjectState& o : sim->objects()) {
    EXPECT_LT((o.X_WorldObject.translation() - start[o.name]).norm(), 0.004) << o.name;
  }
}

TEST(WorldFile, mistakes_are_named_with_file_and_line) {
  const std::vector<std::pair<const char*, const char*>> wrong = {
      {"tabel: {}\n", "line 1: tabel is no key here; allowed are table"},
      {"? [1]\n: 1\n? {a: 2}\n: 2\ntable: {}\n", "is no key here"},  // keys that are no words
      {"table: {size_m: [0.4]}\n", "table.size_m must be a list of 2 numbers"},
      {"table: {size_m: [0.4, -1]}\n", "table.size_m has -1 in it"},
      {"objects:\n  - {object: cube, name: a}\n", "needs position_m"},
      {"objects:\n  - {object: cube, position_m: [0, nan]}\n", "must be a list of numbers"},
      {"objects:\n  - {object: dragon, position_m: [0, 0]}\n", "dragon.yaml"},
      {"objects:\n  - {object: ../../etc/passwd, position_m: [0, 0]}\n", "there is no object file"},
      {"objects:\n  - {object: cube, name: a, position_m: [0, 0], colour: mauve}\n", "allowed are black"},
      {"objects:\n  - {object: cube, name: a, position_m: [0, 0], mass_kg: 0}\n", "mass_kg is 0"},
      {"objects:\n  - {object: cube, position_m: [0, 0]}\n  - {object: cube, position_m: [0, 1]}\n",
       "is taken"},
      {"objects: 3\n", "must be a list"},
      {"posture_deg: {right_arm: [1, 2]}\n", "right_arm has 16 joints, not 2"},
      {"random: {candidates: [blue cube]}\n", "target_regions must list"},
      {"[1, 2\n", "line"},
  };
  for (const auto& [yaml, sentence] : wrong) {
    SimulationOptions options = robot_only();
    options.world_yaml = yaml;
    const auto made = Simulation::create(options);
    ASSERT_FALSE(made.ok()) << yaml;
    EXPECT_NE(made.error().message.find(sentence), std::string::npos)
        << yaml << " -> " << made.error().message;
  }
  SimulationOptions options = with_world("no_such_world");
  EXPECT_FALSE(Simulation::create(options).ok());
  options = with_world("table");
  options.target = "purple cow";
  EXPECT_FALSE(Simulation::create(options).ok());
}

TEST(Scene, shows_robot_and_things_and_keeps_its_order) {
  auto sim = make(with_world("table"));
  SceneSnapshot scene;
  sim->scene(scene);
  const std::size_t count = scene.instances.size();
  const std::uint64_t revision = scene.revision;
  EXPECT_GT(count, 80U);
  ASSERT_TRUE(sim->step(0.1).ok());
  sim->scene(scene);
  EXPECT_EQ(scene.revision, revision);
  ASSERT_EQ(scene.instances.size(), count);
  for (const VisualInstance& i : scene.instances) EXPECT_TRUE(i.X_WorldShape.matrix().allFinite()) << i.name;
  ASSERT_EQ(sim->world("world mk box 0.1 0.1 0.1 0 1 2 1 0 0"), "[ok]");
  sim->scene(scene);
  EXPECT_NE(scene.revision, revision);
  EXPECT_EQ(scene.instances.size(), count + 1);
}

// every line that help shows as an example is refused with a word too many, with the usage, and changes
// nothing
TEST(WorldPort, words_too_many_are_refused_with_the_usage) {
  auto sim = make_yaml("table: {}\n");
  ASSERT_EQ(sim->world("world mk box 0.05 0.05 0.05 0.1 0.6 0.3 1 0 0"), "[ok]");
  const std::uint64_t hash = sim->state_hash();
  std::istringstream help(sim->world("help"));
  int verbs = 0;
  int told = 0;
  for (std::string line; std::getline(help, line);) {
    if (!line.starts_with("world ") || line.starts_with("world help")) continue;
    const std::string verb = line.substr(6, line.find_first_of(" :", 6) - 6);
    const std::string one = sim->world("world help " + verb);
    const std::size_t at = one.find("example: ");
    ASSERT_NE(at, std::string::npos) << one;
    const std::string example = one.substr(at + 9);
    const std::string reply = sim->world(example + " superfluous");
    EXPECT_TRUE(reply.starts_with("[fail]")) << example << " -> " << reply;
    // some take any words for a name
    if (reply.starts_with("[fail] \"too many words\"")) {
      EXPECT_NE(reply.find("say world " + verb), std::string::npos) << reply;
      ++told;
    }
    ++verbs;
  }
  EXPECT_GT(verbs, 30);
  EXPECT_GT(told, 20);
  EXPECT_EQ(sim->state_hash(), hash);
}

// names that no file system takes
TEST(WorldPort, names_beyond_all_files_are_refused) {
  auto sim = make_yaml("table: {}\n");
  const std::string name(300, 'a');
  for (const std::string& line : {"world mk model " + name + ".obj none 0 1 0", "world set mdir " + name,
                                  "world load " + name, "world save " + name, "world restore " + name})
    EXPECT_TRUE(sim->world(line).starts_with("[fail]")) << line;
  SimulationOptions options = robot_only();
  options.world_yaml = "objects:\n  - {object: " + name + ", position_m: [0, 0]}\n";
  EXPECT_FALSE(Simulation::create(options).ok());
  options.world_yaml.clear();
  options.world_path = name;
  EXPECT_FALSE(Simulation::create(options).ok());
}

}  // namespace
}  // namespace nido::sim
