// The verbs on what runs: messages of unknown type, parameters, the clock.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tool.h"

namespace nido::test {
namespace {

using Json = nlohmann::json;

class WithLab : public testing::Test {
 protected:
  void SetUp() override {
    const Ended ready = nido_tool({"port", "info", "/lab/packet:o", "--wait", "20"});
    ASSERT_EQ(ready.code, 0) << ready.err;
  }
  Program lab_{LAB_NODE, {"--name", "lab", "--domain", std::to_string(test_domain())}};
};

TEST_F(WithLab, AMessageThatNidoWasNotBuiltWithIsReadAndWritten) {
  const Ended read = nido_tool({"port", "read", "/lab/packet:o", "--count", "1", "--json"});
  ASSERT_EQ(read.code, 0) << read.err;
  const Json packet = Json::parse(read.out);
  EXPECT_GT(packet["number"], 0);
  EXPECT_EQ(packet["samples"][0]["label"], "left");
  EXPECT_EQ(packet["samples"][0]["axes"], Json::parse("[1.0, 0.0, 0.0]"));
  EXPECT_EQ(packet["samples"][0]["raw"], Json::parse("[1, -2]"));

  Program reader(NIDO,
                 {"port", "read", "/lab/packet:o", "--json", "--domain", std::to_string(test_domain())});
  ASSERT_TRUE(reader.wait_for("left"));
  const Ended written =
      nido_tool({"port", "write", "/lab/packet:i", "{number: 4711, samples: [{label: sent, channel: 7}]}"});
  EXPECT_EQ(written.code, 0) << written.err;
  EXPECT_TRUE(reader.wait_for(R"("channel":7)")) << reader.err();

  const Ended refused = nido_tool({"port", "write", "/lab/packet:i", "{samples: [{label: 3}]}"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.err.find("'samples.0.label' is 3; expected text"), std::string::npos) << refused.err;
}

TEST_F(WithLab, WhatFailsIsJsonForWhoAskedForJson) {
  struct Case {
    std::vector<std::string> words;
    int code;
    std::string says;
  };
  for (const auto& [words, code, says] : std::vector<Case>{
           {{"port", "info", "/lab/packt:o", "--wait", "0", "--json"}, 3, "/lab/packt:o"},
           {{"node", "info", "labb", "--wait", "0", "--json"}, 3, "labb"},
           {{"param", "get", "lab", "no.such", "--json"}, 3, "no.such"},
           {{"port", "write", "/lab/packet:i", "{samples: [{label: 3}]}", "--json"}, 2, "samples.0.label"},
           {{"port", "inf", "--json"}, 2, "info"},
           {{"port", "info", "--json"}, 2, "port"},
       }) {
    const Ended ended = nido_tool(words);
    EXPECT_EQ(ended.code, code) << ended.err;
    const Json told = Json::parse(ended.out, nullptr, false);
    ASSERT_TRUE(told.is_object()) << ended.out << ended.err;
    EXPECT_EQ(told["exit_code"], code);
    const auto sentence = told["sentence"].get<std::string>();
    EXPECT_NE(sentence.find(says), std::string::npos) << sentence;
    EXPECT_NE(ended.err.find("error: " + sentence), std::string::npos) << ended.err;
  }
}

TEST_F(WithLab, ItsRecordingSaysWhatItsMessagesAre) {
  const auto file =
      std::filesystem::temp_directory_path() / ("nido_lab_" + std::to_string(getpid()) + ".mcap");
  Program recorder(NIDO, {"record", "-o", file.string(), "/lab/packet:o", "--for", "0.5", "--domain",
                          std::to_string(test_domain())});
  EXPECT_EQ(recorder.wait().code, 0) << recorder.err();
  Program info(NIDO, {"replay", file.string(), "--info", "--json"});
  const Json ports = Json::parse(info.wait().out)["ports"];
  std::filesystem::remove(file);
  ASSERT_EQ(ports.size(), 1U);
  EXPECT_EQ(ports[0]["type"], "lab_msgs/msg/Packet");
  EXPECT_EQ(ports[0]["schema"], "omgidl");
  EXPECT_GT(ports[0]["messages"], 0);
}

TEST_F(WithLab, ADefinitionFromAFileIsUsedAndAWrongOneRefused) {
  const Ended read = nido_tool({"port", "read", "/lab/packet:o", "--count", "1", "--json", "--idl", LAB_IDL});
  EXPECT_EQ(read.code, 0) << read.err;
  EXPECT_NE(read.out.find(R"("label":"left")"), std::string::npos) << read.out;
  const auto file = std::filesystem::temp_directory_path() / ("nido_idl_" + std::to_string(getpid()));
  std::ofstream(file) << "struct A {\n  thing x;\n};\n";
  const Ended wrong = nido_tool({"port", "read", "/lab/packet:o", "--count", "1", "--idl", file.string()});
  std::filesystem::remove(file);
  EXPECT_EQ(wrong.code, 2);
  EXPECT_NE(wrong.err.find("line 2: a type that is defined before"), std::string::npos) << wrong.err;
  const Ended nothing = nido_tool({"port", "read", "/lab/packet:o", "--count", "1", "--idl", "/nowhere.idl"});
  EXPECT_EQ(nothing.code, 3);
}

TEST_F(WithLab, ParametersAreListedSetAndSaved) {
  const Ended list = nido_tool({"param", "list", "lab"});
  ASSERT_EQ(list.code, 0) << list.err;
  EXPECT_EQ(list.out, "gain  1 V  (double, 0 to 10, can be set now)  of every axis\n");
  EXPECT_EQ(nido_tool({"param", "set", "lab", "gain", "2.5"}).code, 0);
  EXPECT_EQ(nido_tool({"param", "get", "lab", "gain"}).out, "2.5\n");
  Program reader(NIDO,
                 {"port", "read", "/lab/packet:o", "--json", "--domain", std::to_string(test_domain())});
  EXPECT_TRUE(reader.wait_for(R"("axes":[2.5,0.0,0.0])")) << reader.err();
  const Ended refused = nido_tool({"param", "set", "lab", "gain", "11"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.err.find("from 0 to 10 V is allowed"), std::string::npos) << refused.err;
  EXPECT_EQ(nido_tool({"param", "get", "lab", "gian"}).code, 3);

  const auto file = std::filesystem::temp_directory_path() / ("nido_params_" + std::to_string(getpid()));
  EXPECT_EQ(nido_tool({"param", "save", "lab", file.string()}).code, 0);
  std::ifstream in(file);
  const std::string saved((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  EXPECT_EQ(saved, "# parameters of node lab\ngain: 2.5\n");
  std::filesystem::remove(file);
}

TEST(Clock, NobodyOwnsOneWithoutASimulator) {
  const Ended ended = nido_tool({"clock", "--wait", "0.5"});
  EXPECT_EQ(ended.code, 3);
  EXPECT_NE(ended.err.find("nobody owns a simulated clock"), std::string::npos) << ended.err;
}

}  // namespace
}  // namespace nido::test
