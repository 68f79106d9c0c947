// `nido record`, `nido replay` and `nido launch --record` as processes.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "../cli/tool.h"
#include "contents.h"
#include "mcap_core.h"
#include "nido/middleware/node.h"
#include "nido/recorder/raw_message.h"
#include "temp_folder.h"

namespace nido::test {
namespace {

using Words = std::vector<std::string>;
using std::chrono::seconds;

const std::string kDomain = "28";

// nido VERB ..., in a domain of this test program's own.
Words in_domain(Words words) {
  words.insert(words.end(), {"--domain", kDomain});
  return words;
}

Program source(const Words& counts) {
  Words words = {"--domain", kDomain, "--period", "0.002"};
  for (const auto& count : counts) words.insert(words.end(), {"--set", count});
  return Program(RECORDER_SOURCE, words);
}

void expect_whole(const std::vector<Kept>& messages, std::size_t count) {
  ASSERT_EQ(messages.size(), count);
  for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(messages[i].sequence, i + 1);
}

TEST(RecordVerb, TwoProcessesRecordAndReplay) {
  const TempFolder folder;
  const std::string first = (folder.path() / "first.mcap").string();
  const std::string second = (folder.path() / "second.mcap").string();
  {
    Program recorder(NIDO, in_domain({"record", "-o", first, "/source/*", "--json"}));
    auto writer = source({"joints=400", "images=5", "texts=400"});
    ASSERT_TRUE(writer.wait_for("all written")) << writer.out() << writer.err() << recorder.err();
    writer.signal(SIGTERM);
    writer.wait();
    recorder.signal(SIGINT);
    const auto ended = recorder.wait();
    EXPECT_EQ(ended.code, 0) << ended.err;
    const auto report = nlohmann::json::parse(ended.out, nullptr, false);
    ASSERT_TRUE(report.is_object()) << ended.out;
    EXPECT_EQ(report["messages"], 810);
    EXPECT_EQ(report["lost"], 0);
  }
  const auto before = contents_of(first);
  expect_whole(before.at("/source/joints:o"), 400);
  expect_whole(before.at("/source/text:o"), 400);
  expect_whole(before.at("/source/left:o"), 5);
  expect_whole(before.at("/source/right:o"), 5);

  Program info(NIDO, {"replay", first, "--info", "--json"});
  const auto told = nlohmann::json::parse(info.wait().out, nullptr, false);
  EXPECT_EQ(told["messages"], 810);
  EXPECT_EQ(told["ports"].size(), 4U);
  EXPECT_EQ(told["ports"][0]["lost"], 0);

  {
    Program recorder(NIDO, in_domain({"record", "-o", second, "/source/text:o", "/source/left:o"}));
    ASSERT_TRUE(recorder.wait_for("/source/text:o is waited for"));
    Program player(NIDO,
                   in_domain({"replay", first, "/source/*", "--readers", "1", "--wait", "20", "--except",
                              "/source/right:o", "--except", "/source/joints:o", "--rate", "2"}));
    const auto played = player.wait();
    EXPECT_EQ(played.code, 0) << played.err;
    EXPECT_NE(played.out.find("405 messages"), std::string::npos) << played.out;
    recorder.signal(SIGINT);
    const auto ended = recorder.wait();
    EXPECT_EQ(ended.code, 0) << ended.err << ended.out;
  }
  const auto after = contents_of(second);
  EXPECT_EQ(data_of(before.at("/source/text:o")), data_of(after.at("/source/text:o")));
  EXPECT_EQ(data_of(before.at("/source/left:o")), data_of(after.at("/source/left:o")));
}

TEST(RecordVerb, AKilledRecorderLeavesAFileThatReads) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  Program recorder(NIDO, in_domain({"record", "-o", file, "/source/text:o"}));
  auto writer = source({"texts=1000000"});
  ASSERT_TRUE(writer.wait_for("begun")) << writer.out();
  // until some chunks are in the file
  const auto deadline = std::chrono::steady_clock::now() + seconds(30);
  std::size_t count = 0;
  while (count < 500 && std::chrono::steady_clock::now() < deadline) {
    auto reader = mcap::Reader::open(file);
    if (reader) count = (*reader)->message_count();
    usleep(50'000);
  }
  const auto killed_ns = static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                                        std::chrono::system_clock::now().time_since_epoch())
                                                        .count());
  recorder.signal(SIGKILL);
  recorder.wait();
  auto reader = mcap::Reader::open(file);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_NE((*reader)->damage().find("ends in the middle"), std::string::npos);
  const auto messages = contents_of(**reader).at("/source/text:o");
  ASSERT_GE(messages.size(), 500U);
  for (std::size_t i = 0; i < messages.size(); ++i) ASSERT_EQ(messages[i].sequence, i + 1);
  // the last second may be missing, no more
  EXPECT_GT(messages.back().publish_time_ns + 1'000'000'000U, killed_ns);
  // and it can be replayed
  Program player(NIDO,
                 in_domain({"replay", file, "--rate", "max", "--name", "player", "--except", "/source/*"}));
  EXPECT_EQ(player.wait().code, 3);  // no port is left
}

TEST(RecordVerb, TheLibraryOfOthersReadsARecordingAndWhatAKilledOneLeft) {
  const TempFolder folder;
  for (const int signal : {SIGINT, SIGKILL}) {
    const std::string file = (folder.path() / (std::to_string(signal) + ".mcap")).string();
    Program recorder(NIDO, in_domain({"record", "-o", file, "/source/*"}));
    auto writer = source({"joints=1500", "images=5", "texts=1500"});
    ASSERT_TRUE(writer.wait_for("all written")) << writer.out() << writer.err() << recorder.err();
    recorder.signal(signal);
    recorder.wait();
    const auto view = view_with_mcap_core(file);
    if (!view.absent.empty()) GTEST_SKIP() << view.absent;
    ASSERT_EQ(view.complaint, "");
    EXPECT_EQ(view.contents["is_indexed"], signal == SIGINT);
    const auto& topics = view.contents["topics"];
    const std::size_t least = signal == SIGINT ? 1500 : 900;
    EXPECT_GE(topics["/source/text:o"]["count"], least);
    EXPECT_GE(topics["/source/joints:o"]["count"], least);
    EXPECT_EQ(topics["/source/text:o"]["first"]["data"], "text 0");
    EXPECT_EQ(topics["/source/joints:o"]["type"], "sensor_msgs::msg::JointState");
    EXPECT_EQ(topics["/source/joints:o"]["first"]["position"]["length"], 53);
    EXPECT_EQ(topics["/source/left:o"]["count"], 5);
    EXPECT_EQ(topics["/source/left:o"]["first"]["width"], 640);
    EXPECT_EQ(topics["/source/left:o"]["first"]["data"]["length"], 640 * 480 * 3);
    if (signal == SIGINT) {
      EXPECT_EQ(view.contents["metadata"]["nido.losses"]["total"], "0");
    }
  }
}

TEST(RecordVerb, LossIsInTheFileAndInTheExitCode) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  // a megabyte of room, images of nine tenths of that, ten at once
  Program recorder(NIDO, in_domain({"record", "-o", file, "/source/*", "--memory", "1"}));
  ASSERT_TRUE(recorder.wait_for("recording"));
  auto writer = source({"images=60"});
  ASSERT_TRUE(writer.wait_for("all written")) << writer.err();
  writer.signal(SIGTERM);
  writer.wait();
  recorder.signal(SIGINT);
  const auto ended = recorder.wait();
  EXPECT_EQ(ended.code, 1) << ended.out;
  EXPECT_NE(ended.err.find("messages that were written are not in the file"), std::string::npos) << ended.err;
  auto reader = mcap::Reader::open(file);
  ASSERT_TRUE(reader.ok());
  const auto lost = std::stoull((*reader)->metadata_named("nido.losses")->at("total"));
  EXPECT_GT(lost, 0U);
  EXPECT_EQ((*reader)->message_count() + lost, 120U);
}

TEST(RecordVerb, APortThatNeverComesIsNamed) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  Program recorder(NIDO, in_domain({"record", "-o", file, "/no/such:o", "--for", "0.3"}));
  const auto ended = recorder.wait();
  EXPECT_EQ(ended.code, 3);
  EXPECT_NE(ended.err.find("/no/such:o"), std::string::npos);
  Program wrong(NIDO, in_domain({"record", "-o", file, "/vision/left:i"}));
  EXPECT_EQ(wrong.wait().code, 2);
  Program rate(NIDO, in_domain({"replay", file, "--rate", "fast"}));
  EXPECT_EQ(rate.wait().code, 2);
  Program missing(NIDO, in_domain({"replay", (folder.path() / "b.mcap").string()}));
  EXPECT_EQ(missing.wait().code, 3);
}

TEST(RecordVerb, TypesThatNobodyKnowsAreReadAndRecordedToo) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  NodeOptions options;
  options.name = "other";
  options.domain = std::stoi(kDomain);
  options.handle_signals = false;
  auto node = Node::create(options);
  ASSERT_TRUE(node.ok()) << node.error().message;
  auto output = (*node)->open_raw_output("/other/thing:o", raw_message_type("other_msgs/msg/Thing"),
                                         Profile::kState, 16);
  ASSERT_TRUE(output.ok()) << output.error().message;
  const RawMessage message(std::string_view("\0\1\0\0\x2a\0\0\0", 8));
  ASSERT_TRUE((*output)->write(&message).ok());
  Program reader(NIDO,
                 in_domain({"port", "read", "/other/thing:o", "--count", "1", "--json", "--wait", "20"}));
  const auto read = reader.wait();
  EXPECT_EQ(read.code, 0) << read.err;
  EXPECT_NE(read.out.find("\"cdr\":\"000100002a000000\""), std::string::npos) << read.out;
  EXPECT_NE(read.out.find("other_msgs/msg/Thing"), std::string::npos) << read.out;
  Program recorder(NIDO, in_domain({"record", "-o", file, "/other/thing:o"}));
  ASSERT_TRUE(recorder.wait_for("recording"));
  ASSERT_TRUE((*output)->wait_for_readers(1, 20.0));
  ASSERT_TRUE((*output)->write(&message).ok());
  ASSERT_TRUE(becomes_true([&] {
    auto reading = mcap::Reader::open(file);
    return reading && (*reading)->message_count() >= 1;
  }));
  recorder.signal(SIGINT);
  EXPECT_EQ(recorder.wait().code, 0);
  auto recorded = mcap::Reader::open(file);
  ASSERT_TRUE(recorded.ok());
  EXPECT_TRUE((*recorded)->schemas().empty());
  EXPECT_EQ((*recorded)->channels().at(0).metadata.at("type"), "other_msgs/msg/Thing");
  EXPECT_EQ(contents_of(**recorded).at("/other/thing:o").back().data, std::string(message.bytes()));
}

const char* const kApp = R"(name: small
processes:
  - name: body
    program: TEST_NODE
    clock: owner
    parameters: {behaviour: clock, lockstep: {nodes: "${lockstep_nodes}"}}
  - name: judge
    program: TEST_NODE
    parameters: {behaviour: judge, at: 150}
    depends_on: [body]
story: /judge/stage:o
outcome: /judge/outcome:o
)";

TEST(RecordVerb, ARunInLockstepIsRecordedWholeAndTheSameTwice) {
  const TempFolder folder;
  std::string text = kApp;
  for (auto at = text.find("TEST_NODE"); at != std::string::npos; at = text.find("TEST_NODE")) {
    text.replace(at, 9, TEST_NODE);
  }
  const std::string app = folder.write("small.yaml", text);
  std::vector<Contents> runs;
  for (const std::string name : {"one", "two"}) {
    const std::string file = (folder.path() / (name + ".mcap")).string();
    Program run(NIDO, {"launch", app, "--domain", kDomain, "--out", (folder.path() / name).string(),
                       "--record", file, "--lockstep"});
    const auto ended = run.wait();
    ASSERT_EQ(ended.code, 0) << ended.out << ended.err;
    auto reader = mcap::Reader::open(file);
    ASSERT_TRUE(reader.ok()) << reader.error().message;
    EXPECT_EQ((*reader)->damage(), "");
    EXPECT_EQ((*reader)->metadata_named("nido.recording")->at("lockstep"), "true");
    EXPECT_EQ((*reader)->metadata_named("nido.losses")->at("total"), "0");
    runs.push_back(contents_of(**reader));
  }
  // up to the outcome; how soon the processes end after that is a matter of the machine
  constexpr std::uint64_t kEnd_ns = 1'500'000'000;
  for (const std::string port : {"/clock", "/judge/stage:o", "/judge/outcome:o"}) {
    std::array<std::vector<std::string>, 2> data;
    for (std::size_t i = 0; i < 2; ++i) {
      for (const auto& message : runs[i].at(port)) {
        if (message.log_time_ns > kEnd_ns + 10'000'000 && port == "/clock") break;
        data[i].push_back(std::to_string(message.log_time_ns) + message.data);
      }
    }
    EXPECT_FALSE(data[0].empty()) << port;
    EXPECT_EQ(data[0], data[1]) << port;
  }
  // no tick is missing
  const auto& clock = runs[0].at("/clock");
  for (std::size_t i = 1; i < clock.size(); ++i) {
    ASSERT_EQ(clock[i].log_time_ns, clock[i - 1].log_time_ns + 10'000'000) << i;
  }
}

}  // namespace
}  // namespace nido::test
