// What the experimenter changes in room and eyes.
#include "condition.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

namespace nido {
namespace {

namespace fs = std::filesystem;

class ConditionTest : public testing::Test {
 protected:
  void SetUp() override {
    setenv("NIDO_CONFIG_DIR", NIDO_CONFIG, 1);
    folder_ = fs::temp_directory_path() / ("nido_condition_test_" + std::to_string(getpid()));
  }
  void TearDown() override { fs::remove_all(folder_); }

  Result<std::vector<std::string>> make(const Condition& condition) {
    const auto places = find_places();
    if (!places) return places.error();
    return make_condition(*places, condition, "random_table", "icub_sim", folder_);
  }
  static std::string after(const std::vector<std::string>& words, const std::string& option) {
    const auto found = std::find(words.begin(), words.end(), option);
    return found == words.end() ? "" : *(found + 1);
  }

  fs::path folder_;
};

TEST_F(ConditionTest, NormalIsTheFilesAsTheyAre) {
  const auto words = make(*condition_of("normal"));
  ASSERT_TRUE(words) << words.error().message;
  EXPECT_EQ(*words, (std::vector<std::string>{"--world", "random_table", "--robot", "icub_sim"}));
}

TEST_F(ConditionTest, DegradedChangesLightTableAndEyesAndTellsTheJudgeAlone) {
  const auto words = make(*condition_of("degraded"));
  ASSERT_TRUE(words) << words.error().message;
  const YAML::Node world = YAML::LoadFile(after(*words, "--world"));
  EXPECT_DOUBLE_EQ(world["light"]["brightness"].as<double>(), 0.5);
  EXPECT_NEAR(world["table"]["top_center_m"][2].as<double>(), -0.0526, 1e-9);
  EXPECT_EQ(after(*words, "--set").rfind("judge.table_z_m=-0.0526", 0), 0U);
  EXPECT_EQ(std::count(words->begin(), words->end(), "--set"), 1);
  const YAML::Node robot = YAML::LoadFile(after(*words, "--robot"));
  int noisy = 0;
  for (const YAML::Node& device : robot["devices"]) {
    if (device["kind"].as<std::string>() != "sim/eye") continue;
    EXPECT_GT(device["parameters"]["noise_levels"].as<double>(), 0.0);
    ++noisy;
  }
  EXPECT_EQ(noisy, 2);
  EXPECT_TRUE(fs::exists(robot["simulation"]["urdf"].as<std::string>()));
}

TEST_F(ConditionTest, AnUnknownOneIsToldWhichThereAre) {
  const auto unknown = condition_of("foggy");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("degraded"), std::string::npos) << unknown.error().message;
}

}  // namespace
}  // namespace nido
