// nido as a person has it before them: the tabulator in real shells, and Ctrl-C.
#include "terminal.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "temp_folder.h"
#include "tool.h"

namespace nido::test {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

std::string domain() { return std::to_string(test_domain()); }

// A node `robot` that drives /clock and takes /body/command:i.
class InATerminal : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(becomes_true([] {
      return nido_tool({"port", "list"}).out.find("/body/command:i") != std::string::npos;
    }));
  }
  Program robot_{TEST_NODE, {"--name", "robot", "--domain", domain(), "--set", "behaviour=clock"}};
  TempFolder folder_;
};

// types at a prompt, with the completion of this shell sourced
void complete_in(Terminal& shell, const std::string& name) {
  shell.type("source <(nido completion " + name + ") && echo rea''dy\n");
  ASSERT_TRUE(shell.wait_for("ready")) << shell.text();
  shell.type("nido port r\t\t");
  EXPECT_TRUE(shell.wait_for("read") && shell.wait_for("rpc")) << shell.text();
  shell.type("\x15nido launch spee\t");
  EXPECT_TRUE(shell.wait_for("speech_and_action")) << shell.text();
  // one name, with a colon in it, and it goes on behind it
  shell.type("\x15: nido; nido port write --domain " + domain() + " /body/com\t");
  EXPECT_TRUE(shell.wait_for("/body/command:i")) << shell.text();
  shell.type(
      "\x15"
      "exit\n");
  EXPECT_EQ(shell.wait(), 0) << shell.text();
}

std::map<std::string, std::string> shell_environment() {
  const char* path = std::getenv("PATH");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  return {{"PATH", fs::path(NIDO).parent_path().string() + ":" + (path == nullptr ? "" : path)},
          {"TERM", "vt100"},
          {"HISTFILE", "/dev/null"}};
}

TEST_F(InATerminal, BashCompletes) {
  Terminal shell("/bin/bash", {"--norc", "--noprofile", "-i"}, shell_environment());
  complete_in(shell, "bash");
}

TEST_F(InATerminal, ZshCompletes) {
  const auto zsh = fs::exists("/bin/zsh") ? "/bin/zsh" : "/usr/bin/zsh";
  if (!fs::exists(zsh)) GTEST_SKIP() << "zsh is not installed";
  Terminal shell(zsh, {"-f", "-i"}, shell_environment());
  shell.type("autoload -U compinit && compinit -u -D\n");
  complete_in(shell, "zsh");
}

// Typed while the verb works; `sign` is what tells that it does, else that it has joined its domain.
void interrupt(const Words& words, const std::string& sign = "", int code = 130) {
  std::string line = "nido";
  for (const auto& word : words) line += " " + word;
  Terminal terminal(NIDO, words, {{"ROS_DOMAIN_ID", domain()}});
  if (sign.empty()) {
    ASSERT_TRUE(becomes_true([&] {
      const fs::path threads = "/proc/" + std::to_string(terminal.pid()) + "/task";
      return std::distance(fs::directory_iterator(threads), {}) > 3;
    })) << line;
  } else {
    ASSERT_TRUE(terminal.wait_for(sign)) << line << ": " << terminal.text();
  }
  terminal.type("\x03");
  EXPECT_EQ(terminal.wait(), code) << line << ": " << terminal.text();
  for (const char* wrong : {"Traceback", "terminate called", "what()", "core dumped"}) {
    EXPECT_EQ(terminal.text().find(wrong), std::string::npos) << line << ": " << terminal.text();
  }
  EXPECT_TRUE(becomes_true([&] { return terminal.living().empty(); })) << line;
}

TEST_F(InATerminal, CtrlCEndsEveryVerbThatLooks) {
  interrupt({"port", "read", "/clock"}, "clock");
  interrupt({"port", "read", "/nowhere:o", "--wait", "600"});
  interrupt({"port", "hz", "/clock", "--for", "600"});
  interrupt({"port", "ping", "/body/command:i", "--count", "100000"}, "ms");
  interrupt({"port", "rpc", "/nowhere:i", "help", "--wait", "600"});
  interrupt({"port", "write", "/nowhere:i", "1", "--wait", "600"});
  interrupt({"port", "connect", "/clock", "/nowhere:i", "--wait", "600"});
  interrupt({"node", "info", "nobody", "--wait", "600"});
  interrupt({"param", "list", "nobody", "--wait", "600"});
  interrupt({"world", "--wait", "600", "num"});
}

TEST_F(InATerminal, CtrlCEndsEveryVerbThatWorks) {
  const std::string file = (folder_.path() / "run.mcap").string();
  interrupt({"record", "-o", file, "/clock"}, "messages", 0);  // its usual end
  interrupt({"replay", file, "--loop", "--name", "again", "--domain",
             std::to_string(test_domain() + 1 > 100 ? 60 : test_domain() + 1)});
}

}  // namespace
}  // namespace nido::test
