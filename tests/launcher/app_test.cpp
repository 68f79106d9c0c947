#include "nido/launcher/app.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "temp_folder.h"

namespace nido {
namespace {

const char* const kSmall = R"(name: small
processes:
  - name: robot
    program: nido-robot
    clock: owner
  - name: vision
    program: nido-vision
    depends_on: [robot]
    parameters:
      threshold: 0.5
      folder: ${out}/pictures
connections:
  - {out: "/icubSim/cam/left/image:o", in: "/vision/left:i"}
)";

class AppFile : public testing::Test {
 protected:
  Result<App> load(const std::string& text, const std::vector<std::string>& sets = {},
                   const std::vector<Override>& options = {}) {
    return load_app(folder_.write("app.yaml", text), options, sets);
  }
  // The complaint, without the folder.
  std::string complaint(const std::string& text, const std::vector<std::string>& sets = {}) {
    auto app = load(text, sets);
    if (app) return "accepted";
    std::string message = app.error().message;
    const std::string prefix = folder_.path().string() + "/";
    if (const auto at = message.find(prefix); at != std::string::npos) message.erase(at, prefix.size());
    EXPECT_EQ(app.error().code, ErrorCode::kInvalidArgument) << message;
    return message;
  }
  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    return text;
  }
  test::TempFolder folder_;
};

TEST_F(AppFile, AProcessMayBeCalledAsADefaultIs) {
  const auto app = load(kSmall, {"robot=fake", "robot.base=free"});
  ASSERT_TRUE(app.ok()) << app.error().message;
  EXPECT_EQ(app->robot, "fake");
  ASSERT_EQ(app->processes[0].name, "robot");
  EXPECT_EQ(app->processes[0].parameters["base"].as<std::string>(), "free");
}

TEST_F(AppFile, TheShippedAppsAreValid) {
  int count = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(NIDO_SOURCE_DIR) + "/config/apps")) {
    auto app = load_app(entry.path().string());
    EXPECT_TRUE(app.ok()) << app.error().message;
    ++count;
  }
  EXPECT_GE(count, 1);
}

TEST_F(AppFile, ReadsProcessesConnectionsAndDefaults) {
  auto app = load(kSmall);
  ASSERT_TRUE(app.ok()) << app.error().message;
  EXPECT_EQ(app->name, "small");
  EXPECT_EQ(app->seed, 1U);
  EXPECT_EQ(app->rate, "max");
  EXPECT_TRUE(app->lockstep);
  EXPECT_EQ(app->domain, -1);
  ASSERT_EQ(app->processes.size(), 2U);
  EXPECT_EQ(app->processes[0].clock, "owner");
  EXPECT_EQ(app->processes[1].clock, "lockstep");
  EXPECT_EQ(app->processes[1].depends_on, std::vector<std::string>{"robot"});
  EXPECT_FALSE(app->processes[1].restart.on_failure);
  EXPECT_EQ(app->connections.front().second, "/vision/left:i");
}

TEST_F(AppFile, TheHandThatActsStandsInConnections) {
  const std::string text =
      "name: a\nprocesses:\n  - {name: x, program: p, parameters: {side: '${hand}'}}\nconnections:\n"
      "  - {out: '/icubSim/${hand}_arm/state:o', in: '/x/arm:i'}\n";
  EXPECT_EQ(load(text)->connections.front().first, "/icubSim/right_arm/state:o");
  const auto left = load(text, {"hand=left"});
  ASSERT_TRUE(left.ok()) << left.error().message;
  EXPECT_EQ(left->connections.front().first, "/icubSim/left_arm/state:o");
  EXPECT_NE(complaint(text, {"hand=third"}).find("expected one of right, left"), std::string::npos);
  EXPECT_NE(complaint("name: a\nprocesses:\n  - {name: x, program: p}\nconnections:\n"
                      "  - {out: '/icubSim/${seed}/state:o', in: '/x/arm:i'}\n")
                .find("may hold the reference ${hand} and no other"),
            std::string::npos);
}

TEST_F(AppFile, StartsAProcessAfterThoseItDependsOn) {
  auto app = load(
      "name: a\nprocesses:\n  - {name: x, program: p, depends_on: [z]}\n  - {name: y, program: p}\n"
      "  - {name: z, program: p, depends_on: [y]}\n");
  ASSERT_TRUE(app.ok()) << app.error().message;
  EXPECT_EQ(app->start_order, (std::vector<std::size_t>{1, 2, 0}));
}

TEST_F(AppFile, DumpIsAValidAppThatDumpsTheSame) {
  auto app = load(kSmall, {"seed=9", "vision.threshold=0.25"});
  ASSERT_TRUE(app.ok()) << app.error().message;
  const std::string dump = dump_app(*app);
  EXPECT_NE(dump.find("restart:"), std::string::npos) << dump;
  EXPECT_NE(dump.find("ready_timeout_s: 30"), std::string::npos) << dump;
  EXPECT_NE(dump.find("seed: 9"), std::string::npos) << dump;
  EXPECT_NE(dump.find("threshold: 0.25"), std::string::npos) << dump;
  EXPECT_NE(dump.find("${out}/pictures"), std::string::npos) << dump;
  auto again = load(dump);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(dump_app(*again), dump);
}

TEST_F(AppFile, SetTakesShortAndLongKeys) {
  auto app = load(kSmall, {"seed=7", "rate=2.5", "vision.deep.er=[1, 2]",
                           "processes.vision.restart.policy=on-failure", "defaults.audio.start_s=3"});
  ASSERT_TRUE(app.ok()) << app.error().message;
  EXPECT_EQ(app->seed, 7U);
  EXPECT_EQ(app->rate, "2.5");
  EXPECT_EQ(app->processes[1].parameters["deep"]["er"][1].as<int>(), 2);
  EXPECT_TRUE(app->processes[1].restart.on_failure);
  EXPECT_EQ(app->audio["start_s"].as<double>(), 3.0);
}

TEST_F(AppFile, TheLastSetWins) {
  auto app = load(kSmall, {"seed=7", "seed=8"});
  ASSERT_TRUE(app.ok()) << app.error().message;
  EXPECT_EQ(app->seed, 8U);
}

TEST_F(AppFile, WrongSetsAreRefused) {
  EXPECT_TRUE(complaint(kSmall, {"sede=7"})
                  .starts_with("--set sede=7: there is no key 'sede'; did you mean 'seed'?; allowed: "));
  EXPECT_TRUE(complaint(kSmall, {"visoin.threshold=7"})
                  .starts_with("--set visoin.threshold=7: there is no key 'visoin'; did you mean 'vision'?"));
  EXPECT_EQ(complaint(kSmall, {"seed=many"}),
            "--set seed=many: 'seed' of defaults is 'many'; expected a whole number from 0 to 4294967295");
  EXPECT_EQ(complaint(kSmall, {"seed"}), "--set seed: expected KEY=VALUE, as in --set seed=3");
  EXPECT_EQ(complaint(kSmall, {"=3"}), "--set =3: expected KEY=VALUE, as in --set seed=3");
  EXPECT_TRUE(complaint(kSmall, {"seed=[1"}).starts_with("--set seed=[1: the value is no YAML"));
  EXPECT_EQ(complaint(kSmall, {"vision=3"}),
            "--set vision=3: 'vision' is a whole process: name one of its parameters, as in vision.KEY");
  EXPECT_EQ(complaint(kSmall, {"processes.grasp.period_s=3"}),
            "--set processes.grasp.period_s=3: there is no process 'grasp'; there are: robot, vision");
  EXPECT_EQ(complaint(kSmall, {"processes.vision.period_s=0"}),
            "--set processes.vision.period_s=0: 'period_s' of process 'vision' is '0'; expected a number "
            "from 0.001 to 10");
  EXPECT_TRUE(complaint(kSmall, {"processes.vision.perod_s=1"})
                  .starts_with("--set processes.vision.perod_s=1: process 'vision' has no key 'perod_s'; did "
                               "you mean 'period_s'?"));
}

TEST_F(AppFile, WrongFilesAreRefusedWithTheirLine) {
  EXPECT_TRUE(complaint("name: small\n").starts_with("app.yaml:1: the app lacks the key 'processes'"));
  EXPECT_EQ(complaint("name: small\nprocesses: []\n"),
            "app.yaml:2: 'processes' is empty: there is nothing to start");
  EXPECT_EQ(complaint(replaced(kSmall, "[robot]", "[robto]")),
            "app.yaml:8: process 'vision' depends on 'robto', which is no process; did you mean 'robot'?; "
            "there are: robot, vision");
  EXPECT_EQ(complaint(replaced(kSmall, "[robot]", "[vision]")),
            "app.yaml:8: process 'vision' depends on itself");
  EXPECT_EQ(complaint(replaced(kSmall, "clock: owner", "depends_on: [vision]")),
            "app.yaml:3: these processes wait for each other in a circle: robot, vision");
  EXPECT_EQ(complaint(replaced(kSmall, "depends_on: [robot]", "clock: owner")),
            "app.yaml:6: process 'vision' is a second owner of the clock; there can be one");
  EXPECT_TRUE(
      complaint(replaced(kSmall, "${out}", "${ot}"))
          .starts_with(
              "app.yaml:11: there is no reference ${ot}; did you mean 'out'?; allowed: app, robot_file"));
  EXPECT_EQ(complaint(replaced(kSmall, "${out}", "${out")),
            "app.yaml:11: '${out/pictures' has a ${ without its }");
  EXPECT_EQ(complaint(replaced(kSmall, "\"/icubSim", "\"icubSim")),
            "app.yaml:13: 'out' of connection 1 is 'icubSim/cam/left/image:o'; the name of an output port "
            "starts with a slash "
            "and does not end in :i");
  EXPECT_EQ(complaint(replaced(kSmall, "left:i", "left:o")),
            "app.yaml:13: 'in' of connection 1 is '/vision/left:o'; the name of an input port starts with a "
            "slash and ends in :i");
  EXPECT_EQ(
      complaint(replaced(kSmall, "name: vision", "name: vi/sion")),
      "app.yaml:6: 'name' of process 'vi/sion' is 'vi/sion'; a name is made of letters, digits, _ and -");
  EXPECT_EQ(complaint(std::string(kSmall) + "defaults: {audio: {source: wav}}\n"),
            "app.yaml:14: 'source' of audio is 'wav', but there is no 'file' (--audio FILE)");
  EXPECT_EQ(complaint(std::string(kSmall) + "defaults: {audio: {source: radio}}\n"),
            "app.yaml:14: 'source' of audio is 'radio'; expected one of wav, synthesis, microphone, silence");
}

TEST(References, AWholeTextBecomesTheValueAndAPartBecomesText) {
  const std::map<std::string, YAML::Node> values = {{"nodes", YAML::Load("[a, b]")},
                                                    {"out", YAML::Node("/o")}};
  const YAML::Node filled =
      fill_references(YAML::Load("{x: '${nodes}', y: ['${out}/p', 3], z: plain}"), values);
  EXPECT_EQ(filled["x"][1].as<std::string>(), "b");
  EXPECT_EQ(filled["y"][0].as<std::string>(), "/o/p");
  EXPECT_EQ(filled["y"][1].as<int>(), 3);
  EXPECT_EQ(filled["z"].as<std::string>(), "plain");
}

}  // namespace
}  // namespace nido
