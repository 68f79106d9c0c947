// What a shell is told at the tabulator.
#include <gtest/gtest.h>

#include <sstream>

#include "tool.h"

namespace nido::test {
namespace {

using Words = std::vector<std::string>;

Words lines_of(const std::string& text) {
  Words lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

Words completed(Words words) {
  words.insert(words.begin(), "complete");
  Program nido(NIDO, words);
  const auto ended = nido.wait();
  EXPECT_EQ(ended.code, 0) << ended.err;
  return lines_of(ended.out);
}

bool has(const Words& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

TEST(Completion, VerbsAndOptionsAreThoseOfTheCommandLine) {
  EXPECT_EQ(completed({"po"}), Words{"port"});
  EXPECT_EQ(completed({"port", "r"}), (Words{"read", "rpc"}));
  EXPECT_EQ(completed({"port", "read", "--co"}), Words{"--count"});
  EXPECT_EQ(completed({"nonsense", "x"}), Words{});
  const auto options = completed({"launch", "app", "--"});
  for (const char* option : {"--seed", "--record", "--world", "--help"})
    EXPECT_TRUE(has(options, option)) << option;
}

TEST(Completion, NamesFitTheirPlace) {
  EXPECT_TRUE(has(completed({"launch", "speech"}), "speech_and_action"));
  EXPECT_TRUE(has(completed({"launch", "x", "--world", ""}), "table"));
  const auto robots = completed({"launch", "x", "--robot", ""});
  EXPECT_TRUE(has(robots, "icub_sim"));
  EXPECT_FALSE(has(robots, "grasp_postures")) << "that is no robot";
  EXPECT_EQ(completed({"replay", "a.mcap", "--rate", ""}), Words{"max"});
  // a file: the shell knows better
  EXPECT_EQ(completed({"replay", ""}), Words{});
}

TEST(Completion, PortsAreThoseThatAreThere) {
  const std::string domain = std::to_string(test_domain());
  Program node(TEST_NODE, {"--name", "robot", "--domain", domain, "--set", "behaviour=clock"});
  ASSERT_TRUE(becomes_true([&] {
    return has(completed({"port", "read", "--domain", domain, ""}), "/clock");
  }));
  EXPECT_EQ(completed({"port", "write", "--domain", domain, "/body/"}), Words{"/body/command:i"});
  EXPECT_EQ(completed({"port", "rpc", "--domain", domain, ""}), (Words{"/body/estop", "/robot/control"}));
  EXPECT_EQ(completed({"node", "info", "--domain", domain, ""}), Words{"robot"});
  EXPECT_EQ(completed({"node", "call", "--domain", domain, ""}), Words{"robot"});
}

TEST(Completion, BashCompletesNamesWithColons) {
  const std::string domain = std::to_string(test_domain());
  Program node(TEST_NODE, {"--name", "robot", "--domain", domain, "--set", "behaviour=clock"});
  ASSERT_TRUE(becomes_true([&] {
    return has(completed({"port", "write", "--domain", domain, ""}), "/body/command:i");
  }));
  const auto reply = [&](const std::string& line) {
    Program bash("/bin/bash", {"-c",
                               "source <(\"$0\" completion bash); COMP_LINE=$1; COMP_POINT=${#1}; _nido; "
                               "echo \"${COMPREPLY[*]}\"",
                               NIDO, std::string(NIDO) + " " + line});
    return lines_of(bash.wait().out);
  };
  EXPECT_EQ(reply("port wr"), Words{"write"});
  EXPECT_EQ(reply("port write --domain " + domain + " /bo"), Words{"/body/command:i"});
  // readline keeps what is before the colon
  EXPECT_EQ(reply("port write --domain " + domain + " /body/command:"), Words{"i"});
}

TEST(Completion, OtherShellsAreRefused) {
  EXPECT_EQ(nido_tool({"completion", "fish"}).code, 2);
  EXPECT_NE(nido_tool({"completion", "zsh"}).out.find("#compdef nido"), std::string::npos);
}

}  // namespace
}  // namespace nido::test
