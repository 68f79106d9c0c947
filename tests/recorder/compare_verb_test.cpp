// `nido compare`.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "../cli/tool.h"
#include "nido/recorder/idl_text.h"
#include "nido/recorder/mcap_writer.h"
#include "temp_folder.h"

namespace nido::test {
namespace {

struct Written {
  std::string port;
  std::uint64_t time_ns;
  std::string text;
};

// CDR of a std_msgs/msg/String
std::string bytes_of(const std::string& text) {
  std::string bytes("\0\1\0\0", 4);
  const auto size = static_cast<std::uint32_t>(text.size() + 1);
  for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>(size >> (8 * i)));
  return bytes + text + '\0';
}

class Compare : public testing::Test {
 protected:
  std::string file(const std::string& name, const std::vector<Written>& messages) {
    const std::string path = (folder_.path() / name).string();
    auto writer = mcap::Writer::create(path);
    EXPECT_TRUE(writer.ok());
    const std::string type = "std_msgs/msg/String";
    const auto schema =
        (*writer)->add_schema({0, scoped_name_of(type), "omgidl", std::string(idl_text_of(type))});
    std::map<std::string, std::uint16_t> channels;
    for (const Written& message : messages) {
      if (!channels.contains(message.port)) {
        channels[message.port] = *(*writer)->add_channel({0, *schema, message.port, "cdr", {}});
      }
      const std::string data = bytes_of(message.text);
      EXPECT_TRUE((*writer)->write({channels[message.port], 1, message.time_ns, message.time_ns, data}).ok());
    }
    EXPECT_TRUE((*writer)->close().ok());
    return path;
  }
  static Ended compare(std::vector<std::string> words) {
    words.insert(words.begin(), "compare");
    Program program(NIDO, words);
    return program.wait();
  }
  TempFolder folder_;
};

TEST_F(Compare, TheSameIsTheSameInWhateverOrderWithinAMoment) {
  const std::string a =
      file("a.mcap", {{"/a:o", 0, "one"}, {"/b:o", 0, "x"}, {"/a:o", 0, "two"}, {"/a:o", 9, "end"}});
  const std::string b =
      file("b.mcap", {{"/b:o", 0, "x"}, {"/a:o", 0, "two"}, {"/a:o", 0, "one"}, {"/a:o", 9, "end"}});
  const Ended ended = compare({a, b});
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(ended.out, "the same: 4 messages on 2 ports in 0.00 s, bit for bit\n");
}

TEST_F(Compare, TheFirstDifferenceOfEachPortIsNamedByItsField) {
  const std::string a = file(
      "a.mcap",
      {{"/a:o", 0, "one"}, {"/b:o", 0, "x"}, {"/a:o", 2'000'000'000, "two"}, {"/b:o", 3'000'000'000, "y"}});
  const std::string b = file(
      "b.mcap",
      {{"/a:o", 0, "one"}, {"/b:o", 0, "x"}, {"/a:o", 2'000'000'000, "too"}, {"/b:o", 3'000'000'000, "y"}});
  const Ended ended = compare({a, b});
  EXPECT_EQ(ended.code, 1) << ended.err;
  EXPECT_EQ(ended.out,
            "/a:o: 1 messages are the same, then at 2.000 s: data: \"two\" and \"too\"\n"
            "not the same: first on /a:o at 2.000 s; 3 messages in all are the same\n");
  EXPECT_EQ(compare({a, b, "/b:o"}).code, 0);
  EXPECT_EQ(compare({a, b, "--except", "/a"}).code, 0);
  EXPECT_EQ(compare({a, b, "--to", "1.5"}).code, 0);
  const auto json = nlohmann::json::parse(compare({a, b, "--json"}).out);
  EXPECT_EQ(json["same"], false);
  EXPECT_EQ(json["ports"][0]["difference"]["time_s"], 2.0);
}

TEST_F(Compare, AMissingMessageOrPortIsADifference) {
  const std::string a =
      file("a.mcap", {{"/a:o", 0, "one"}, {"/a:o", 1'000'000'000, "two"}, {"/a:o", 2'000'000'000, "three"}});
  const std::string b = file("b.mcap", {{"/a:o", 0, "one"}, {"/a:o", 2'000'000'000, "three"}});
  const Ended gap = compare({a, b});
  EXPECT_EQ(gap.code, 1);
  EXPECT_NE(gap.out.find("then at 1.000 s: only the first has a message then"), std::string::npos) << gap.out;
  const std::string c =
      file("c.mcap", {{"/a:o", 0, "one"}, {"/a:o", 2'000'000'000, "three"}, {"/c:o", 0, "more"}});
  const Ended port = compare({b, c});
  EXPECT_EQ(port.code, 1);
  EXPECT_NE(port.out.find("only the second has /c:o"), std::string::npos) << port.out;
}

TEST_F(Compare, WhatIsNoRecordingIsRefused) {
  const std::string a = file("a.mcap", {{"/a:o", 0, "one"}});
  EXPECT_EQ(compare({a, (folder_.path() / "none.mcap").string()}).code, 3);
  EXPECT_EQ(compare({a, NIDO}).code, 2);
  EXPECT_EQ(compare({a}).code, 2);
}

}  // namespace
}  // namespace nido::test
