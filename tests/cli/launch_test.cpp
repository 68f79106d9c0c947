// Whole runs of `nido launch` with small nodes: outcome, failures, restarts, ends by signal, and what they
// leave.
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "temp_folder.h"
#include "tool.h"

namespace nido::test {
namespace {
namespace fs = std::filesystem;
using std::chrono::seconds;
using std::chrono::steady_clock;

class Launch : public testing::Test {
 protected:
  // One process a line of YAML: "name: vision, parameters: {...}".
  std::string app(const std::vector<std::string>& processes, const std::string& more = "") {
    std::string text =
        "name: small\nsummary: a small app\nstory: /judge/stage:o\noutcome: /judge/outcome:o\nprocesses:\n";
    for (const auto& process : processes)
      text += fs::path("  - {program: ").string() + TEST_NODE + ", " + process + "}\n";
    return folder_.write("small.yaml", text + more);
  }
  std::unique_ptr<Program> launch(const std::string& file, std::vector<std::string> more = {}) {
    std::vector<std::string> words = {"launch",       file,       "--out",
                                      out().string(), "--domain", std::to_string(test_domain())};
    words.insert(words.end(), more.begin(), more.end());
    return std::make_unique<Program>(NIDO, words);
  }
  fs::path out() const { return folder_.path() / "out"; }
  // No process of the run lives, janitor included.
  bool nothing_lives() const {
    return becomes_true(
        [this] { return processes_with(out().string()).empty() && janitors() <= janitors_before_; },
        seconds(5));
  }
  static std::size_t janitors() {
    return processes_with((fs::path(NIDO).parent_path() / "nido-janitor").string()).size();
  }
  TempFolder folder_;
  std::size_t janitors_before_ = janitors();
  const std::string robot_ =
      "name: robot, clock: owner, parameters: {behaviour: clock, lockstep: {nodes: '${lockstep_nodes}'}}";
  const std::string judge_ =
      "name: judge, depends_on: [robot], parameters: {behaviour: judge, out: '${out}'}";
};

TEST_F(Launch, RunsToTheOutcomeAndTellsTheStory) {
  const auto ended = launch(app({robot_, judge_}))->wait();
  EXPECT_EQ(ended.code, 0) << ended.out << ended.err;
  EXPECT_NE(ended.out.find("2 processes are ready"), std::string::npos) << ended.out;
  EXPECT_NE(ended.out.find("seen     the blue cube is there"), std::string::npos) << ended.out;
  EXPECT_NE(ended.out.find("outcome: success: the cube is done"), std::string::npos) << ended.out;
  EXPECT_EQ(ended.out.find('\033'), std::string::npos);
  EXPECT_TRUE(fs::exists(out() / "logs" / "judge.log"));
  EXPECT_TRUE(fs::exists(out() / "nodes" / "robot.yaml"));
  const auto report = nlohmann::json::parse(read_text(out() / "report.json"));
  EXPECT_EQ(report["processes"][1]["name"], "judge");
  EXPECT_EQ(report["processes"][1]["restarts"], 0);
  EXPECT_TRUE(nothing_lives());
}

TEST_F(Launch, AFailedOutcomeIsExitCode1) {
  const auto ended = launch(app({robot_, judge_}), {"--set", "judge.outcome=failed"})->wait();
  EXPECT_EQ(ended.code, 1) << ended.out << ended.err;
  EXPECT_NE(ended.out.find("outcome: failure: the cube is failed"), std::string::npos) << ended.out;
}

TEST_F(Launch, PrintsTheOutcomeAsJson) {
  const auto ended = launch(app({robot_, judge_}), {"--json"})->wait();
  EXPECT_EQ(ended.code, 0) << ended.err;
  const auto object = nlohmann::json::parse(ended.out);
  EXPECT_EQ(object["exit_code"], 0);
  EXPECT_EQ(object["sentence"], "the cube is done");
}

TEST_F(Launch, ARefusedFileIsJsonWithItsPlace) {
  const std::string file = app({"name: eye, restrt: {policy: never}"});
  const auto ended = launch(file, {"--json"})->wait();
  EXPECT_EQ(ended.code, 2) << ended.out << ended.err;
  const auto object = nlohmann::json::parse(ended.out);
  EXPECT_EQ(object["exit_code"], 2);
  EXPECT_EQ(object["file"], file);
  EXPECT_EQ(object["line"], 6);
  EXPECT_NE(object["sentence"].get<std::string>().find("did you mean 'restart'?"), std::string::npos);
}

TEST_F(Launch, AProcessThatFailsBeforeItIsReadyIsReportedWithItsSentence) {
  const auto ended =
      launch(app({robot_, "name: eye, depends_on: [robot], parameters: {behaviour: fail}"}))->wait();
  EXPECT_EQ(ended.code, 3) << ended.out << ended.err;
  EXPECT_NE(ended.out.find("there is no lens in front of the eye"), std::string::npos) << ended.out;
  EXPECT_NE(
      ended.out.find("process 'eye' failed: there is no lens in front of the eye (before it was ready)"),
      std::string::npos)
      << ended.out;
  EXPECT_TRUE(nothing_lives());
}

TEST_F(Launch, AProcessThatIsNeverReadyIsNamed) {
  const auto ended =
      launch(
          app({robot_, "name: eye, depends_on: [robot], ready_timeout_s: 1, parameters: {behaviour: late}"}))
          ->wait();
  EXPECT_EQ(ended.code, 1) << ended.out << ended.err;
  EXPECT_NE(ended.out.find("process 'eye' was not ready within 1 s (it says: starting)"), std::string::npos)
      << ended.out;
}

TEST_F(Launch, ADeathInMidRunFailsTheRunWithItsLastLines) {
  const auto ended =
      launch(app({robot_, "name: eye, depends_on: [robot], parameters: {behaviour: die}"}))->wait();
  EXPECT_EQ(ended.code, 1) << ended.out << ended.err;
  EXPECT_NE(ended.out.find("process 'eye' ended with exit code 4"), std::string::npos) << ended.out;
  EXPECT_NE(ended.out.find("my last words"), std::string::npos) << ended.out;
  EXPECT_TRUE(nothing_lives());
}

TEST_F(Launch, AProcessIsRestartedByItsPolicyThenGivenUp) {
  const auto ended =
      launch(app({robot_,
                  "name: eye, clock: simulated, depends_on: [robot], parameters: {behaviour: die}, restart: "
                  "{policy: on-failure, max: 1, backoff_s: 0.05}"}))
          ->wait();
  EXPECT_EQ(ended.code, 1) << ended.out << ended.err;
  EXPECT_NE(ended.out.find("it is started again in 0.1 s (restart 1 of at most 1)"), std::string::npos)
      << ended.out;
  EXPECT_NE(ended.out.find("process 'eye' is ready again"), std::string::npos) << ended.out;
  EXPECT_NE(ended.out.find("is given up"), std::string::npos) << ended.out;
}

TEST_F(Launch, TheRunGoesOnWithoutAProcessWhosePolicySaysSo) {
  const auto ended =
      launch(app({robot_, "name: judge, depends_on: [robot], parameters: {behaviour: judge, at: 200}",
                  "name: eye, clock: simulated, depends_on: [robot], parameters: {behaviour: die}, restart: "
                  "{policy: on-failure, max: 1, backoff_s: 0, escalate: go-on}"}))
          ->wait();
  EXPECT_EQ(ended.code, 0) << ended.out << ended.err;
}

TEST_F(Launch, WhenTheClockDiesTheRunSaysThatItCannotGoOn) {
  auto run = launch(app({robot_, "name: eye, depends_on: [robot], parameters: {behaviour: follow}"}));
  ASSERT_TRUE(run->wait_for("2 processes are ready")) << run->out() << run->err();
  const auto robots = processes_with("nodes/robot.yaml");
  for (const pid_t pid : robots) {
    if (processes_with(out().string() + "/nodes/robot.yaml") == std::vector<pid_t>{pid}) kill(pid, SIGKILL);
  }
  const auto ended = run->wait();
  EXPECT_EQ(ended.code, 1) << ended.out << ended.err;
  EXPECT_NE(
      ended.out.find(
          "process 'robot' was killed by signal 9 (Killed); it drove the clock that all others wait for"),
      std::string::npos)
      << ended.out;
  EXPECT_TRUE(nothing_lives());
}

TEST_F(Launch, AKilledProcessEndsTheRunAndNothingIsLeft) {
  const auto memory_before = shared_memory_files();
  for (const std::string victim : {"eye", "judge", "robot"}) {
    auto run = launch(app({robot_, "name: eye, depends_on: [robot], parameters: {behaviour: follow}",
                           "name: judge, depends_on: [eye], parameters: {behaviour: judge, at: 1000000}"}));
    ASSERT_TRUE(run->wait_for("3 processes are ready")) << run->out() << run->err();
    const auto pids = processes_with(out().string() + "/nodes/" + victim + ".yaml");
    ASSERT_EQ(pids.size(), 1U);
    kill(pids.front(), SIGKILL);
    const auto ended = run->wait(seconds(20));
    EXPECT_EQ(ended.code, 1) << ended.out << ended.err;
    EXPECT_NE(ended.out.find("process '" + victim + "' was killed by signal 9"), std::string::npos)
        << ended.out;
    EXPECT_TRUE(nothing_lives());
  }
  EXPECT_TRUE(
      becomes_true([&] { return shared_memory_files().size() <= memory_before.size(); }, seconds(10)));
}

TEST_F(Launch, EndsAfterTheSimulatedTimeThatWasAskedFor) {
  const auto ended =
      launch(app({robot_, "name: eye, depends_on: [robot], parameters: {behaviour: follow}"}), {"--for", "1"})
          ->wait();
  EXPECT_EQ(ended.code, 1) << ended.out << ended.err;
  EXPECT_NE(ended.out.find("no outcome within 1 s of simulated time"), std::string::npos) << ended.out;
}

TEST_F(Launch, CtrlCLeavesNothing) {
  for (const int number : {SIGINT, SIGTERM}) {
    auto run = launch(app({robot_, "name: eye, depends_on: [robot], parameters: {behaviour: follow}"}));
    ASSERT_TRUE(run->wait_for("2 processes are ready")) << run->out() << run->err();
    run->signal(number);
    const auto ended = run->wait(seconds(10));
    EXPECT_EQ(ended.code, 130) << ended.out << ended.err;
    EXPECT_TRUE(nothing_lives());
  }
}

TEST_F(Launch, AStubbornProcessIsKilledAndNamed) {
  auto run = launch(app({robot_, "name: eye, depends_on: [robot], parameters: {behaviour: stubborn}"}));
  ASSERT_TRUE(run->wait_for("2 processes are ready")) << run->out() << run->err();
  // a process that is stopped cannot act on SIGTERM
  for (const pid_t pid : processes_with(out().string() + "/nodes/eye.yaml")) kill(pid, SIGSTOP);
  run->signal(SIGINT);
  const auto ended = run->wait(seconds(15));
  EXPECT_EQ(ended.code, 130);
  EXPECT_NE(ended.out.find("process 'eye' did not end when asked and was killed"), std::string::npos)
      << ended.out;
  EXPECT_TRUE(nothing_lives());
}

TEST_F(Launch, ASecondCtrlCKillsAtOnce) {
  auto run = launch(app({robot_, "name: eye, depends_on: [robot], parameters: {behaviour: follow}"}));
  ASSERT_TRUE(run->wait_for("2 processes are ready")) << run->out() << run->err();
  for (const pid_t pid : processes_with(out().string() + "/nodes/eye.yaml")) kill(pid, SIGSTOP);
  const auto start = steady_clock::now();
  run->signal(SIGINT);
  ASSERT_TRUE(run->wait_for("once more kills at once"));
  run->signal(SIGINT);
  EXPECT_EQ(run->wait(seconds(15)).code, 130);
  EXPECT_LT(steady_clock::now() - start, seconds(2));
  EXPECT_TRUE(nothing_lives());
}

TEST_F(Launch, AKilledLauncherLeavesNothing) {
  const auto memory_before = shared_memory_files();
  auto run = launch(app({robot_, "name: eye, depends_on: [robot], parameters: {behaviour: follow}"}));
  ASSERT_TRUE(run->wait_for("2 processes are ready")) << run->out() << run->err();
  // one that does not react has to be killed by the janitor
  for (const pid_t pid : processes_with(out().string() + "/nodes/eye.yaml")) kill(pid, SIGSTOP);
  run->signal(SIGKILL);
  run->wait();
  EXPECT_TRUE(nothing_lives());
  // other runs may come and go meanwhile: none of our files may stay
  EXPECT_TRUE(
      becomes_true([&] { return shared_memory_files().size() <= memory_before.size(); }, seconds(10)));
}

TEST_F(Launch, ASecondRunInTheDomainIsRefusedInASentenceWithTheMend) {
  const std::string file = app({robot_, "name: eye, depends_on: [robot], parameters: {behaviour: follow}"});
  auto run = launch(file);
  ASSERT_TRUE(run->wait_for("2 processes are ready")) << run->out() << run->err();
  const auto refused = launch(file)->wait();
  EXPECT_EQ(refused.code, 2) << refused.out << refused.err;
  EXPECT_NE(refused.err.find(std::to_string(run->pid())), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("--domain " + std::to_string(test_domain() + 1)), std::string::npos)
      << refused.err;
  run->signal(SIGINT);
  EXPECT_EQ(run->wait().code, 130);
}

TEST_F(Launch, AProgramThatIsNotThereIsExitCode3AndNothingStarts) {
  const std::string file =
      folder_.write("a.yaml", "name: a\nprocesses:\n  - {name: x, program: nido-nowhere}\n");
  const auto ended = launch(file)->wait();
  EXPECT_EQ(ended.code, 3);
  EXPECT_NE(ended.err.find("process 'x' of app 'a' needs the program"), std::string::npos) << ended.err;
  EXPECT_FALSE(fs::exists(out()));
}

}  // namespace
}  // namespace nido::test
