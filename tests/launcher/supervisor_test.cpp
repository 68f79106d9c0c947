#include "nido/launcher/supervisor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <functional>

#include "temp_folder.h"

namespace nido {
namespace {
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using Kind = SupervisorEvent::Kind;

class Supervision : public testing::Test {
 protected:
  void SetUp() override {
    auto made = Supervisor::create("");
    ASSERT_TRUE(made.ok()) << made.error().message;
    supervisor_ = std::move(*made);
  }
  static SupervisedProcess process(const std::string& name, std::vector<std::string> arguments) {
    SupervisedProcess result;
    result.name = name;
    result.command.program = TEST_CHILD;
    result.command.arguments = std::move(arguments);
    return result;
  }
  // Polls until an event fits; fails the test after 20 s.
  SupervisorEvent wait_for(const std::function<bool(const SupervisorEvent&)>& fits) {
    const auto until = steady_clock::now() + seconds(20);
    while (steady_clock::now() < until) {
      // what does not fit stays for a later question
      const auto found = std::find_if(seen_.begin(), seen_.end(), fits);
      if (found != seen_.end()) {
        SupervisorEvent event = *found;
        seen_.erase(found);
        return event;
      }
      for (auto& event : supervisor_->poll(milliseconds(200))) seen_.push_back(event);
    }
    ADD_FAILURE() << "the event did not come";
    return {};
  }
  void wait_up(const std::string& name) {
    wait_for([&](const auto& event) { return event.name == name && event.text == "up"; });
  }
  // Ends everything and returns how long it took.
  double stop(milliseconds grace = seconds(2), milliseconds whole = seconds(4),
              milliseconds stagger = milliseconds(250)) {
    const auto start = steady_clock::now();
    supervisor_->begin_stop(grace, whole, stagger);
    while (!supervisor_->all_gone() && steady_clock::now() - start < seconds(20)) {
      for (auto& event : supervisor_->poll(milliseconds(200))) seen_.push_back(event);
    }
    return std::chrono::duration<double>(steady_clock::now() - start).count();
  }
  std::unique_ptr<Supervisor> supervisor_;
  std::vector<SupervisorEvent> seen_;
};

TEST_F(Supervision, AFailureIsReportedWithItsCodeAndLastLines) {
  ASSERT_TRUE(supervisor_->start(process("eye", {"fail"})).ok());
  const auto event = wait_for([](const auto& e) { return e.kind == Kind::kEnded; });
  EXPECT_EQ(event.text, "process 'eye' ended with exit code 3");
  EXPECT_EQ(event.exit.code, 3);
  EXPECT_FALSE(event.exit.clean());
  ASSERT_EQ(event.last_lines.size(), 2U);
  EXPECT_EQ(event.last_lines[1], "cannot open the eye");
  EXPECT_TRUE(supervisor_->all_gone());
}

TEST_F(Supervision, ADeathBySignalIsNamed) {
  ASSERT_TRUE(supervisor_->start(process("arm", {"wait"})).ok());
  wait_up("arm");
  kill(supervisor_->pid_of("arm"), SIGKILL);
  const auto event = wait_for([](const auto& e) { return e.kind == Kind::kEnded; });
  EXPECT_EQ(event.text, "process 'arm' was killed by signal 9 (Killed)");
  EXPECT_TRUE(event.exit.by_signal);
}

TEST_F(Supervision, AProgramThatIsNotThereIsNotFound) {
  auto missing = process("ghost", {});
  missing.command.program = "/nowhere/nido-ghost";
  auto status = supervisor_->start(missing);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(status.error().message, "process 'ghost': there is no program /nowhere/nido-ghost: is it built?");
}

TEST_F(Supervision, AProgramThatCannotBeExecutedIsNamed) {
  const test::TempFolder folder;
  auto text = process("text", {});
  text.command.program = folder.write("text", "no program");
  auto status = supervisor_->start(text);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("cannot be started: Permission denied"), std::string::npos)
      << status.error().message;
}

TEST_F(Supervision, ANameIsGivenOnce) {
  ASSERT_TRUE(supervisor_->start(process("arm", {"wait"})).ok());
  auto status = supervisor_->start(process("arm", {"wait"}));
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kTaken);
}

TEST_F(Supervision, OutputComesByLinesAndIntoTheLog) {
  const test::TempFolder folder;
  auto many = process("many", {"many-lines"});
  many.log_file = (folder.path() / "many.log").string();
  ASSERT_TRUE(supervisor_->start(many).ok());
  wait_for([](const auto& e) { return e.kind == Kind::kOutput && e.text == "line 4999"; });
  const auto event = wait_for([](const auto& e) { return e.kind == Kind::kEnded; });
  EXPECT_EQ(event.last_lines.back(), "no end");
  EXPECT_EQ(event.text, "process 'many' ended with exit code 0");
  const std::string log = test::read_text(folder.path() / "many.log");
  EXPECT_TRUE(log.starts_with("line 0\nline 1\n"));
  EXPECT_TRUE(log.ends_with("line 4999\nno end"));
}

TEST_F(Supervision, TheEnvironmentIsAddedTo) {
  auto child = process("env", {"environment", "NIDO_TEST_VALUE"});
  child.command.environment["NIDO_TEST_VALUE"] = "seven";
  ASSERT_TRUE(supervisor_->start(child).ok());
  wait_for([](const auto& e) { return e.text == "seven"; });
  ASSERT_TRUE(supervisor_->start(process("path", {"environment", "PATH"})).ok());
  const auto line = wait_for([](const auto& e) { return e.name == "path" && e.kind == Kind::kOutput; });
  EXPECT_EQ(line.text, getenv("PATH"));
}

TEST_F(Supervision, StopsInReverseOrder) {
  for (const char* name : {"a", "b", "c"}) ASSERT_TRUE(supervisor_->start(process(name, {"wait"})).ok());
  for (const char* name : {"a", "b", "c"}) wait_up(name);
  stop(seconds(10), seconds(20), seconds(10));
  std::vector<std::string> order;
  for (const auto& event : seen_) {
    if (event.kind == Kind::kEnded) order.push_back(event.name);
  }
  EXPECT_EQ(order, (std::vector<std::string>{"c", "b", "a"}));
  EXPECT_TRUE(supervisor_->killed().empty());
}

TEST_F(Supervision, AStubbornProcessIsKilledAfterTheGrace) {
  ASSERT_TRUE(supervisor_->start(process("good", {"wait"})).ok());
  ASSERT_TRUE(supervisor_->start(process("bad", {"stubborn"})).ok());
  wait_up("good");
  wait_up("bad");
  const double took_s = stop(milliseconds(300), seconds(10));
  EXPECT_TRUE(supervisor_->all_gone());
  EXPECT_EQ(supervisor_->killed(), std::vector<std::string>{"bad"});
  EXPECT_GE(took_s, 0.29);
  EXPECT_LT(took_s, 8);
}

TEST_F(Supervision, ManyStubbornProcessesEndWithinTheWholeGrace) {
  for (const char* name : {"a", "b", "c", "d"})
    ASSERT_TRUE(supervisor_->start(process(name, {"stubborn"})).ok());
  for (const char* name : {"a", "b", "c", "d"}) wait_up(name);
  EXPECT_LT(stop(seconds(60), milliseconds(300)), 20);
  EXPECT_TRUE(supervisor_->all_gone());
  EXPECT_EQ(supervisor_->killed().size(), 4U);
}

TEST_F(Supervision, KillAllEndsEverythingAtOnce) {
  for (const char* name : {"a", "b"}) ASSERT_TRUE(supervisor_->start(process(name, {"stubborn"})).ok());
  for (const char* name : {"a", "b"}) wait_up(name);
  supervisor_->begin_stop(seconds(60), seconds(60));
  supervisor_->kill_all();
  const auto start = steady_clock::now();
  while (!supervisor_->all_gone() && steady_clock::now() - start < seconds(10))
    supervisor_->poll(milliseconds(100));
  EXPECT_TRUE(supervisor_->all_gone());
}

TEST_F(Supervision, WhatAProcessStartedItselfEndsWithIt) {
  ASSERT_TRUE(supervisor_->start(process("family", {"grandchild"})).ok());
  pid_t grandchild = -1;
  wait_for([&](const auto& e) {
    if (e.text.starts_with("grandchild ")) grandchild = std::stoi(e.text.substr(11));
    return grandchild > 0;
  });
  stop(seconds(10), seconds(20), seconds(10));
  const auto until = steady_clock::now() + seconds(10);
  while (start_time_of(grandchild) != 0 && steady_clock::now() < until) supervisor_->poll(milliseconds(20));
  EXPECT_EQ(start_time_of(grandchild), 0U);
}

TEST_F(Supervision, RestartsByPolicyThenGivesUp) {
  auto weak = process("weak", {"abort"});
  weak.restart.on_failure = true;
  weak.restart.max_restarts = 2;
  weak.restart.backoff_s = 0.01;
  ASSERT_TRUE(supervisor_->start(weak).ok());
  const auto first = wait_for([](const auto& e) { return e.kind == Kind::kRestarting; });
  EXPECT_EQ(first.text,
            "process 'weak' was killed by signal 6 (Aborted); it is started again in 0.0 s (restart 1 of at "
            "most 2)");
  wait_for([](const auto& e) { return e.kind == Kind::kRestarted; });
  EXPECT_EQ(supervisor_->restarts_of("weak"), 1);
  wait_for([](const auto& e) { return e.kind == Kind::kRestarted; });
  const auto given_up = wait_for([](const auto& e) { return e.kind == Kind::kGivenUp; });
  EXPECT_EQ(
      given_up.text,
      "process 'weak' was killed by signal 6 (Aborted); it was restarted 2 times in 60 s and is given up");
  EXPECT_EQ(supervisor_->restarts_of("weak"), 2);
  EXPECT_TRUE(supervisor_->all_gone());
}

TEST_F(Supervision, AProcessIsToldHowOftenItWasRestarted) {
  auto weak = process("weak", {"environment", "NIDO_RESTARTS", "fail"});
  weak.restart.on_failure = true;
  weak.restart.max_restarts = 1;
  weak.restart.backoff_s = 0;
  ASSERT_TRUE(supervisor_->start(weak).ok());
  EXPECT_EQ(wait_for([](const auto& e) { return e.kind == Kind::kOutput; }).text, "0");
  EXPECT_EQ(wait_for([](const auto& e) { return e.kind == Kind::kOutput; }).text, "1");
}

TEST_F(Supervision, BackOffDoubles) {
  auto weak = process("weak", {"fail"});
  weak.restart.on_failure = true;
  weak.restart.max_restarts = 3;
  weak.restart.backoff_s = 0.1;
  weak.restart.backoff_max_s = 0.2;
  const auto start = steady_clock::now();
  ASSERT_TRUE(supervisor_->start(weak).ok());
  wait_for([](const auto& e) { return e.kind == Kind::kGivenUp; });
  EXPECT_GE(steady_clock::now() - start, milliseconds(500 - 5));  // 0.1 + 0.2 + 0.2
}

TEST_F(Supervision, ACleanEndIsNotRestarted) {
  auto once = process("once", {"environment", "PATH"});
  once.restart.on_failure = true;
  ASSERT_TRUE(supervisor_->start(once).ok());
  const auto event = wait_for([](const auto& e) { return e.kind != Kind::kOutput; });
  EXPECT_EQ(event.kind, Kind::kEnded);
  EXPECT_TRUE(supervisor_->all_gone());
}

TEST_F(Supervision, NothingIsRestartedWhileStopping) {
  auto weak = process("weak", {"fail"});
  weak.restart.on_failure = true;
  weak.restart.backoff_s = 30;
  weak.restart.backoff_max_s = 30;
  ASSERT_TRUE(supervisor_->start(weak).ok());
  wait_for([](const auto& e) { return e.kind == Kind::kRestarting; });
  EXPECT_FALSE(supervisor_->all_gone());
  EXPECT_LT(stop(), 5);
  EXPECT_TRUE(supervisor_->all_gone());
}

TEST_F(Supervision, TheDestructorLeavesNothing) {
  ASSERT_TRUE(supervisor_->start(process("bad", {"stubborn"})).ok());
  wait_up("bad");
  const pid_t pid = supervisor_->pid_of("bad");
  supervisor_.reset();
  EXPECT_EQ(start_time_of(pid), 0U);
}

}  // namespace
}  // namespace nido
