// The command line as a person uses it: against a running node, and against nothing.
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "temp_folder.h"
#include "tool.h"

namespace nido::test {
namespace {
using std::chrono::seconds;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Usage, HelpOfEveryVerbHasAnExample) {
  const std::vector<std::vector<std::string>> verbs = {{},
                                                       {"launch"},
                                                       {"port"},
                                                       {"port", "list"},
                                                       {"port", "info"},
                                                       {"port", "read"},
                                                       {"port", "write"},
                                                       {"port", "rpc"},
                                                       {"port", "connect"},
                                                       {"port", "disconnect"},
                                                       {"port", "hz"},
                                                       {"port", "bw"},
                                                       {"port", "delay"},
                                                       {"port", "ping"},
                                                       {"node"},
                                                       {"node", "list"},
                                                       {"node", "info"},
                                                       {"world"},
                                                       {"doctor"},
                                                       {"experiment"},
                                                       {"experiment", "list"},
                                                       {"bench"},
                                                       {"record"},
                                                       {"replay"},
                                                       {"experiment", "run"}};
  for (auto words : verbs) {
    words.emplace_back("--help");
    const auto ended = nido_tool(words);
    EXPECT_EQ(ended.code, 0) << ended.err;
    EXPECT_TRUE(contains(ended.out, "example")) << ended.out;
  }
}

TEST(Usage, WrongUsageIsExitCode2) {
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{},
                                             {"lunch"},
                                             {"port"},
                                             {"port", "raed", "/a:o"},
                                             {"port", "read"},
                                             {"port", "read", "/a:o", "--count", "-1"},
                                             {"port", "read", "/a:o", "--domain", "500"},
                                             {"port", "read", "no-slash"},
                                             {"port", "read", "/a/b:i"},
                                             {"launch"},
                                             {"launch", "speech_and_action", "--nonsense"},
                                             {"launch", "speech_and_action", "--seed", "x"},
                                             {"launch", "speech_and_action", "--say", "a", "--mic"},
                                             {"launch", "speech_and_action", "--dashboard=x"},
                                             {"record"},
                                             {"replay", "x.mcap", "--from", "-1"},
                                             {"completion", "fish"},
                                             {"experiment", "run", "speech", "--trials", "0"}}) {
    const auto ended = nido_tool(words);
    std::string line;
    for (const auto& word : words) line += word + " ";
    EXPECT_EQ(ended.code, 2) << line << ": " << ended.out << ended.err;
    EXPECT_TRUE(contains(ended.err, "error: ")) << line << ": " << ended.err;
  }
}

TEST(Usage, AWordThatIsNoVerbIsNamed) {
  EXPECT_TRUE(contains(nido_tool({"lunch"}).err, "nido has no verb 'lunch', did you mean 'launch'?"));
  const auto ended = nido_tool({"port", "raed", "/a:o"});
  EXPECT_TRUE(contains(ended.err, "nido port has no verb 'raed', did you mean 'read'?")) << ended.err;
}

TEST(Usage, WhatIsNotThereIsExitCode3) {
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"port", "read", "/a:o", "--wait", "0.2"},
                                             {"port", "info", "/a:o", "--wait", "0.2"},
                                             {"port", "rpc", "/a/rpc:i", "help", "--wait", "0.2"},
                                             {"port", "connect", "/a:o", "/b:i", "--wait", "0.2"},
                                             {"node", "info", "vision", "--wait", "0.2"},
                                             {"world", "num", "--wait", "0.2"},
                                             {"launch", "no_such_app"},
                                             {"launch", "/nowhere/app.yaml"},
                                             {"launch", "speech_and_action", "--world", "no_such_world"},
                                             {"launch", "speech_and_action", "--audio", "/nowhere.wav"},
                                             {"experiment", "run", "alchemy"}}) {
    const auto ended = nido_tool(words);
    std::string line;
    for (const auto& word : words) line += word + " ";
    EXPECT_EQ(ended.code, 3) << line << ": " << ended.out << ended.err;
    EXPECT_TRUE(contains(ended.err, "error: ")) << line << ": " << ended.err;
  }
}

TEST(Usage, KeysAreMadeAndRefusedAsJson) {
  TempFolder folder;
  const std::string keys = (folder.path() / "keys").string();
  const auto made = nido_tool({"security", "init", keys, "--json"});
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(nlohmann::json::parse(made.out)["folder"], keys);
  const auto added = nido_tool({"security", "add", keys, "watcher", "--read", "/a:o", "--json"});
  EXPECT_EQ(nlohmann::json::parse(added.out)["identity"], keys + "/identities/watcher") << added.err;
  const auto again = nido_tool({"security", "init", keys, "--json"});
  EXPECT_NE(again.code, 0);
  EXPECT_EQ(nlohmann::json::parse(again.out)["exit_code"], again.code) << again.out;
}

TEST(Usage, AnEmptyDomainHasNoPorts) {
  const auto ended = nido_tool({"port", "list", "--json"});
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(nlohmann::json::parse(ended.out), nlohmann::json::array());
}

// A node that writes /judge/stage:o and takes /body/command:i, with the wall clock.
class WithNodes : public testing::Test {
 protected:
  void SetUp() override {
    const std::string domain = std::to_string(test_domain());
    body_ = std::make_unique<Program>(
        TEST_NODE,
        std::vector<std::string>{"--name", "body", "--domain", domain, "--set", "behaviour=clock"});
    const auto ready = nido_tool({"node", "info", "body", "--wait", "20"});
    ASSERT_EQ(ready.code, 0) << ready.err << body_->out() << body_->err();
    ASSERT_TRUE(becomes_true([] { return contains(nido_tool({"port", "list"}).out, "/body/command:i"); }));
  }
  void TearDown() override {
    body_->signal(SIGTERM);
    EXPECT_NE(body_->wait(seconds(10)).code, 128 + SIGKILL);
  }
  std::unique_ptr<Program> body_;
};

TEST_F(WithNodes, ListsAndDescribes) {
  const auto list = nlohmann::json::parse(nido_tool({"node", "list", "--json"}).out);
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list[0]["name"], "body");
  EXPECT_EQ(list[0]["pid"], body_->pid());
  const auto info = nlohmann::json::parse(nido_tool({"port", "info", "/body/command:i", "--json"}).out);
  EXPECT_EQ(info["type"], "nido_msgs/msg/JointCommand");
  EXPECT_EQ(info["direction"], "input");
  EXPECT_EQ(info["node"], "body");
  const auto node = nido_tool({"node", "info", "body"});
  EXPECT_TRUE(contains(node.out, "/body/command:i")) << node.out;
  EXPECT_TRUE(contains(node.out, "behaviour = clock")) << node.out;
}

TEST_F(WithNodes, ANodeIsToldWhatOneOfItsServicesUnderstands) {
  const auto service = nido_tool({"node", "call", "body", "estop", "clear"});
  EXPECT_EQ(service.code, 0) << service.err;
  EXPECT_EQ(service.out, "[ok] clear\n");
  // what no service of the node is called is for the node itself
  const auto itself = nido_tool({"node", "call", "body", "info"});
  EXPECT_EQ(itself.code, 0) << itself.err;
  EXPECT_TRUE(contains(itself.out, "[ok] body ready")) << itself.out;
  const auto nonsense = nido_tool({"node", "call", "body", "sing"});
  EXPECT_EQ(nonsense.code, 1);
  EXPECT_TRUE(contains(nonsense.out, "not understood")) << nonsense.out;
}

TEST_F(WithNodes, AMisspeltNameIsMended) {
  const auto ended = nido_tool({"port", "info", "/body/comand:i", "--wait", "1"});
  EXPECT_EQ(ended.code, 3);
  EXPECT_TRUE(contains(ended.err, "did you mean /body/command:i?")) << ended.err;
}

TEST_F(WithNodes, WritesToAnInput) {
  const auto ended =
      nido_tool({"port", "write", "/body/command:i", "mode=position", "joint=[0]", "value=[0.5]", "--json"});
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(nlohmann::json::parse(ended.out)["value"][0], 0.5);
  const auto wrong = nido_tool({"port", "write", "/body/command:i", "mod=position"});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_TRUE(contains(wrong.err, "did you mean 'mode'?")) << wrong.err;
}

TEST_F(WithNodes, ReadsAndMeasuresAnOutput) {
  const auto read = nido_tool({"port", "read", "/clock", "--count", "3", "--json"});
  EXPECT_EQ(read.code, 0) << read.err;
  EXPECT_TRUE(contains(read.out, "\"nanosec\"")) << read.out;
  for (const char* verb : {"hz", "bw", "delay"}) {
    const auto measured = nido_tool({"port", verb, "/clock", "--for", "0.5", "--json"});
    EXPECT_EQ(measured.code, 0) << measured.err;
    EXPECT_GT(nlohmann::json::parse(measured.out)["messages"], 5) << measured.out;
  }
}

TEST_F(WithNodes, PingsAndConnects) {
  const auto ping = nido_tool({"port", "ping", "/body/command:i", "--count", "2", "--json"});
  EXPECT_EQ(ping.code, 0) << ping.err;
  EXPECT_EQ(nlohmann::json::parse(ping.out)["round_trip_s"].size(), 2U);
  EXPECT_EQ(nido_tool({"port", "connect", "/later:o", "/body/command:i"}).code, 0);
  EXPECT_TRUE(becomes_true([] {
    return contains(nido_tool({"port", "info", "/body/command:i"}).out, "from /later:o: not there now");
  }));
  EXPECT_EQ(nido_tool({"port", "disconnect", "/later:o", "/body/command:i"}).code, 0);
  EXPECT_TRUE(becomes_true([] {
    return !contains(nido_tool({"port", "info", "/body/command:i"}).out, "/later:o");
  }));
}

TEST_F(WithNodes, AServiceIsAskedWithOptionsAnywhere) {
  const auto text = nido_tool({"port", "rpc", "/body/control", "info", "--wait", "10"});
  EXPECT_TRUE(text.code == 0 && contains(text.out, "input /body/command:i")) << text.out << text.err;
  const auto json = nido_tool({"port", "rpc", "/body/control", "info", "--json"});
  EXPECT_TRUE(contains(nlohmann::json::parse(json.out).dump(), "/body/command:i")) << json.out << json.err;
  // negative numbers are no options, and what is behind -- is said as it is
  EXPECT_TRUE(contains(nido_tool({"port", "rpc", "/body/control", "pos", "3", "-45"}).out, "pos 3 -45"));
  EXPECT_TRUE(contains(nido_tool({"port", "rpc", "/body/control", "--", "pos", "--json"}).out, "pos --json"));
  EXPECT_EQ(nido_tool({"port", "rpc", "/body/control", "nonsense"}).code, 1);
}

TEST_F(WithNodes, TheDoctorLooksAtTheMachine) {
  const auto ended = nido_tool({"doctor", "--json"});
  const auto list = nlohmann::json::parse(ended.out);
  EXPECT_GE(list.size(), 8U);
  for (const auto& one : list) {
    EXPECT_TRUE(one["health"] == "good" || one["health"] == "doubtful" || one["health"] == "bad") << one;
    if (one["what"] == "ports") {
      EXPECT_NE(one["health"], "bad") << one;
    }
  }
}

TEST(Doctor, NamesBothEndsOfAConnectionThatDoesNotFit) {
  const std::string domain = std::to_string(test_domain());
  // the input is there first and waits for an output, which then has another type
  Program taker(TEST_NODE, {"--name", "robot", "--domain", domain, "--set", "behaviour=clock", "--connect",
                            "/judge/stage:o=/body/command:i"});
  ASSERT_TRUE(becomes_true([&] { return contains(nido_tool({"port", "list"}).out, "/body/command:i"); }));
  Program giver(TEST_NODE, {"--name", "judge", "--domain", domain, "--clock", "simulated", "--set",
                            "behaviour=judge", "--set", "at=1000000"});
  std::string text;
  ASSERT_TRUE(becomes_true([&] {
    const auto ended = nido_tool({"doctor", "--json"});
    for (const auto& one : nlohmann::json::parse(ended.out)) {
      if (one["what"] == "ports") text = one["text"].get<std::string>();
    }
    return ended.code == 3 && contains(text, "do not connect");
  })) << text;
  EXPECT_TRUE(contains(text, "/judge/stage:o (node judge, nido_msgs/msg/StageEvent, profile event)")) << text;
  EXPECT_TRUE(contains(text, "/body/command:i (node robot, nido_msgs/msg/JointCommand, profile command)"))
      << text;
}

}  // namespace
}  // namespace nido::test
