#include "nido/launcher/run_folder.h"

#include <gtest/gtest.h>

#include "temp_folder.h"

namespace nido {
namespace {
namespace fs = std::filesystem;

class RunFolders : public testing::Test {
 protected:
  void SetUp() override {
    before_ = fs::current_path();
    fs::current_path(folder_.path());
    auto app = load_app(folder_.write("app.yaml", R"(name: small
defaults: {seed: 5, audio: {source: synthesis, text: reach red ball}}
processes:
  - {name: robot, program: nido-robot, clock: owner, parameters: {nodes: "${lockstep_nodes}", audio: "${audio}", world_file: "${world_file}"}}
  - {name: vision, program: nido-vision, parameters: {folder: "${out}/x"}}
  - {name: judge, program: nido-judge, clock: simulated}
connections:
  - {out: /icubSim/cam/left/image:o, in: /vision/left:i}
  - {out: /vision/command:o, in: /icubSim/head/command:i}
)"));
    ASSERT_TRUE(app.ok()) << app.error().message;
    app_ = *app;
  }
  void TearDown() override { fs::current_path(before_); }
  YAML::Node node_file(const std::string& name, const RunFolder& run) {
    for (const auto& process : app_.processes) {
      if (process.name != name) continue;
      auto file = write_node_file(app_, process, {7, "/r.yaml", "/w.yaml"}, {"/bin", "/config"}, run);
      EXPECT_TRUE(file.ok()) << file.error().message;
      return YAML::LoadFile(file->string());
    }
    return {};
  }
  test::TempFolder folder_;
  fs::path before_;
  App app_;
};

TEST_F(RunFolders, LatestPointsToTheLastRun) {
  auto first = make_run_folder(app_, "");
  ASSERT_TRUE(first.ok()) << first.error().message;
  EXPECT_EQ(fs::canonical("out/latest"), fs::canonical(first->path));
  auto second = make_run_folder(app_, "");
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_NE(first->path, second->path);
  EXPECT_EQ(fs::canonical("out/latest"), fs::canonical(second->path));
  EXPECT_TRUE(fs::exists(first->path / "app.yaml"));
}

TEST_F(RunFolders, AFolderInThePlaceOfLatestIsLeftAlone) {
  fs::create_directories("out/latest/mine");
  auto run = make_run_folder(app_, "");
  ASSERT_FALSE(run.ok());
  EXPECT_TRUE(fs::exists("out/latest/mine"));
}

TEST_F(RunFolders, AnOldReportDoesNotStay) {
  fs::create_directories("mine");
  (void)folder_.write("mine/report.json", "{}");
  auto run = make_run_folder(app_, "mine");
  ASSERT_TRUE(run.ok()) << run.error().message;
  EXPECT_EQ(run->path, fs::absolute("mine"));
  EXPECT_FALSE(fs::exists("mine/report.json"));
}

TEST_F(RunFolders, AFolderThatCannotBeMadeIsNamed) {
  (void)folder_.write("file", "");
  auto run = make_run_folder(app_, "file/inner");
  ASSERT_FALSE(run.ok());
  EXPECT_NE(run.error().message.find("file/inner"), std::string::npos);
}

TEST_F(RunFolders, NodeFilesHoldWhatANodeNeeds) {
  auto run = make_run_folder(app_, "");
  ASSERT_TRUE(run.ok()) << run.error().message;
  const YAML::Node robot = node_file("robot", *run);
  EXPECT_EQ(robot["name"].as<std::string>(), "robot");
  EXPECT_EQ(robot["domain"].as<int>(), 7);
  EXPECT_EQ(robot["seed"].as<int>(), 5);
  EXPECT_EQ(robot["parameters"]["world_file"].as<std::string>(), "/w.yaml");
  EXPECT_EQ(robot["parameters"]["audio"]["text"].as<std::string>(), "reach red ball");
  // only those in lockstep, neither the owner nor the judge
  ASSERT_EQ(robot["parameters"]["nodes"].size(), 1U);
  EXPECT_EQ(robot["parameters"]["nodes"][0].as<std::string>(), "vision");
  ASSERT_EQ(robot["connections"].size(), 1U);
  EXPECT_EQ(robot["connections"][0]["in"].as<std::string>(), "/icubSim/head/command:i");
  const YAML::Node vision = node_file("vision", *run);
  EXPECT_EQ(vision["clock"].as<std::string>(), "lockstep");
  EXPECT_EQ(vision["parameters"]["folder"].as<std::string>(), run->path.string() + "/x");
  ASSERT_EQ(vision["connections"].size(), 1U);
  EXPECT_EQ(vision["connections"][0]["out"].as<std::string>(), "/icubSim/cam/left/image:o");
  app_.lockstep = false;
  EXPECT_EQ(node_file("vision", *run)["clock"].as<std::string>(), "simulated");
  EXPECT_EQ(node_file("robot", *run)["parameters"]["nodes"].size(), 0U);
}

}  // namespace
}  // namespace nido
