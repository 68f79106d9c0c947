// Patches of skin: where their taxels are, and what they feel.
#include "nido/simulator/skin.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <set>
#include <sstream>

#include "world_fixture.h"

namespace nido::sim {
namespace {

constexpr double kBall_m = 0.02;

std::size_t patch_index(const Simulation& sim, const std::string& name) {
  for (std::size_t i = 0; i < sim.skin().size(); ++i) {
    if (sim.skin()[i].name == name) return i;
  }
  ADD_FAILURE() << "no patch " << name;
  return 0;
}

// Where a ball has to be made to be pressed a millimetre into the skin over a taxel; the world port's frame.
std::string ball_at(const Simulation& sim, const SkinPatch& patch, const Taxel& taxel,
                    double gap_m = -0.001) {
  const Eigen::Vector3d p =
      *sim.X_WorldLink(patch.link) * (taxel.p_Link_m + (kBall_m + gap_m) * taxel.out_Link);
  std::ostringstream line;
  line.precision(10);
  line << "world mk ssph " << kBall_m << " " << -p.y() << " " << p.z() - Simulation::kFloorHeight_m << " "
       << -p.x() - 0.026 << " 1 0 0";
  return line.str();
}

double sum_N(const std::vector<TaxelForce>& touch) {
  return std::accumulate(touch.begin(), touch.end(), 0.0,
                         [](double sum, const TaxelForce& taxel) { return sum + taxel.force_N; });
}

const Taxel& taxel_of(const SkinPatch& patch, int value) {
  return *std::find_if(patch.taxels.begin(), patch.taxels.end(),
                       [value](const Taxel& taxel) { return taxel.value == value; });
}

double force_on(const Simulation& sim, const std::string& link) {
  double force_N = 0;
  for (const ContactPair& pair : sim.contacts()) {
    if (pair.a == link || pair.b == link) force_N += pair.force_N;
  }
  return force_N;
}

TEST(Skin, has_the_patches_of_the_robots_ports) {
  const auto sim = make(robot_only());
  struct Expected {
    const char* name;
    std::size_t values;
    std::size_t taxels;
  };
  for (const Expected& expected :
       {Expected{"left_forearm", 384, 240}, Expected{"right_forearm", 384, 240},
        Expected{"left_arm", 768, 350}, Expected{"right_arm", 768, 350}, Expected{"torso", 768, 440}}) {
    const SkinPatch& patch = sim->skin()[patch_index(*sim, expected.name)];
    EXPECT_EQ(patch.values, expected.values);
    EXPECT_EQ(patch.taxels.size(), expected.taxels);
    std::set<int> values;
    for (const Taxel& taxel : patch.taxels) {
      EXPECT_TRUE(values.insert(taxel.value).second) << taxel.value;
      EXPECT_LT(taxel.value, static_cast<int>(patch.values));
      // those of a triangle that measure temperature
      EXPECT_NE(taxel.value % 12, 6);
      EXPECT_NE(taxel.value % 12, 10);
      EXPECT_NEAR(taxel.out_Link.norm(), 1, 1e-6);
    }
  }
}

TEST(Skin, left_and_right_mirror_each_other) {
  const auto sim = make(robot_only());
  for (const char* name : {"forearm", "arm"}) {
    const SkinPatch& left = sim->skin()[patch_index(*sim, std::string("left_") + name)];
    const SkinPatch& right = sim->skin()[patch_index(*sim, std::string("right_") + name)];
    const Eigen::Isometry3d X_WorldLeft = *sim->X_WorldLink(left.link);
    const Eigen::Isometry3d X_WorldRight = *sim->X_WorldLink(right.link);
    // a triangle's middle: its rows are numbered from its own left, which a mirror turns round
    for (std::size_t first = 0; first < left.taxels.size(); first += 10) {
      Eigen::Vector3d p_left = Eigen::Vector3d::Zero();
      Eigen::Vector3d p_right = Eigen::Vector3d::Zero();
      for (std::size_t i = first; i < first + 10; ++i) {
        p_left += X_WorldLeft * left.taxels[i].p_Link_m / 10;
        p_right += X_WorldRight * right.taxels[i].p_Link_m / 10;
      }
      EXPECT_LT((p_left - Eigen::Vector3d(p_right.x(), -p_right.y(), p_right.z())).norm(), 0.001);
    }
  }
}

TEST(Skin, feels_what_is_put_against_it_where_it_is_and_how_strong) {
  const auto sim = make(robot_only());
  for (std::size_t patch = 0; patch < sim->skin().size(); ++patch) {
    const SkinPatch skin = sim->skin()[patch];
    EXPECT_TRUE(sim->skin_touch(patch).empty());
    // one taxel in the middle of every fifth triangle
    for (std::size_t i = 5; i < skin.taxels.size(); i += 50) {
      const Taxel& taxel = skin.taxels[i];
      SCOPED_TRACE(skin.name + " " + std::to_string(taxel.value));
      ASSERT_EQ(sim->world(ball_at(*sim, skin, taxel)), "[ok]");
      ASSERT_TRUE(sim->step(0.2).ok());
      const std::vector<TaxelForce>& touch = sim->skin_touch(patch);
      ASSERT_FALSE(touch.empty());
      // all of the force, to the solver's change within a period
      const double force_N = force_on(*sim, skin.link);
      EXPECT_GT(force_N, 0.1);
      EXPECT_NEAR(sum_N(touch), force_N, 0.02 * force_N);
      // the taxels lie in flat triangles on a round arm, so the strongest one is near, not the nearest
      const TaxelForce strongest =
          *std::max_element(touch.begin(), touch.end(),
                            [](const TaxelForce& a, const TaxelForce& b) { return a.force_N < b.force_N; });
      EXPECT_LT((taxel_of(skin, strongest.value).p_Link_m - taxel.p_Link_m).norm(), 0.009);
      for (const TaxelForce& felt : touch)
        EXPECT_LT((taxel_of(skin, felt.value).p_Link_m - taxel.p_Link_m).norm(), 0.03) << felt.value;
      for (std::size_t other = 0; other < sim->skin().size(); ++other) {
        // between arm and torso the ball may touch both
        EXPECT_TRUE(sim->skin_touch(other).empty() || force_on(*sim, sim->skin()[other].link) > 0)
            << sim->skin()[other].name;
      }
      ASSERT_EQ(sim->world("world del all"), "[ok]");
      ASSERT_EQ(sim->world("world reset"), "[ok]");
      EXPECT_TRUE(sim->skin_touch(patch).empty());
    }
  }
}

TEST(Skin, says_nothing_or_the_same_when_it_is_broken) {
  const auto sim = make(robot_only());
  const std::size_t forearm = patch_index(*sim, "right_forearm");
  const SkinPatch patch = sim->skin()[forearm];
  ASSERT_EQ(sim->world(ball_at(*sim, patch, patch.taxels[105])), "[ok]");
  ASSERT_TRUE(sim->step(0.1).ok());
  const std::vector<TaxelForce> felt = sim->skin_touch(forearm);
  ASSERT_FALSE(felt.empty());
  ASSERT_EQ(sim->world("world fault skin right_forearm stuck"), "[ok]");
  EXPECT_EQ(sim->world("world fault"), "(skin right_forearm stuck)");
  const SavedState stuck = sim->save();
  ASSERT_TRUE(sim->step(0.1).ok());
  EXPECT_EQ(sim->skin_touch(forearm), felt);
  ASSERT_EQ(sim->world("world fault skin right_forearm off"), "[ok]");
  ASSERT_TRUE(sim->step(0.05).ok());
  EXPECT_TRUE(sim->skin_touch(forearm).empty());
  ASSERT_EQ(sim->world("world fault clear"), "[ok]");
  ASSERT_TRUE(sim->step(0.05).ok());
  EXPECT_FALSE(sim->skin_touch(forearm).empty());
  ASSERT_TRUE(sim->restore(stuck).ok());
  EXPECT_EQ(sim->skin_touch(forearm), felt) << "a saved state has the skin in it";
  EXPECT_EQ(sim->world("world fault"), "(skin right_forearm stuck)");
  const std::string refused = sim->world("world fault skin left_ear off");
  EXPECT_NE(refused.find("left_forearm"), std::string::npos) << refused;
}

// The robot's description with one piece of text in place of another, beside its meshes' folder.
Result<std::unique_ptr<Simulation>> with_changed_body(const std::string& piece, const std::string& other) {
  std::ifstream file(config("robots/icub.urdf"));
  std::ostringstream content;
  content << file.rdbuf();
  std::string text = content.str();
  const std::size_t at = text.find(piece);
  if (at == std::string::npos) return Error{ErrorCode::kNotFound, "the robot has no " + piece};
  text.replace(at, piece.size(), other);
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) /
                                       testing::UnitTest::GetInstance()->current_test_info()->name();
  std::filesystem::create_directories(folder);
  std::filesystem::remove(folder / "meshes");
  std::filesystem::create_directory_symlink(std::filesystem::absolute(config("robots/meshes")),
                                            folder / "meshes");
  std::ofstream(folder / "body.urdf") << text;
  SimulationOptions options;
  options.urdf_path = folder / "body.urdf";
  return Simulation::create(options);
}

TEST(Skin, wrong_descriptions_are_refused_with_place_and_reason) {
  struct Wrong {
    const char* piece;
    const char* other;
    const char* says;
  };
  for (const Wrong& wrong :
       {Wrong{"values=\"384\"", "values=\"385\"", "twelve values a triangle"},
        Wrong{"values=\"384\"", "values=\"-12\"", "whole number"},
        Wrong{"values=\"384\"", "values=\"12\"", "whole number up to 0"},
        Wrong{"link=\"l_forearm\" values", "link=\"l_tail\" values", "l_tail"},
        Wrong{"link=\"l_forearm\" values", "link=\"chest\" values", "wears two patches"},
        Wrong{"<triangle number=\"1\"", "<triangle number=\"0\"", "two triangles 0"},
        Wrong{"<triangle number=\"0\" xyz=\"", "<triangle number=\"0\" xyz=\"nan ", "three numbers"},
        Wrong{"<triangle number=\"0\"", "<triangle", "needs the attribute \"number\""},
        Wrong{"name=\"left_forearm\"", "name=\"torso\"", "two patches \"torso\""}}) {
    const auto made = with_changed_body(wrong.piece, wrong.other);
    ASSERT_FALSE(made.ok()) << wrong.other;
    EXPECT_NE(made.error().message.find(wrong.says), std::string::npos) << made.error().message;
    EXPECT_NE(made.error().message.find("body.urdf, line "), std::string::npos) << made.error().message;
  }
}

}  // namespace
}  // namespace nido::sim
