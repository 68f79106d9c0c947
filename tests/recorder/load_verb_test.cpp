// What a robot writes in a minute: two cameras of 640x480 at 30 Hz and 53 joints at 1 kHz. Nothing of it may
// be lost, and a recorder that is killed loses the last second at most.
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "../cli/tool.h"
#include "contents.h"
#include "temp_folder.h"

namespace nido::test {
namespace {

using Words = std::vector<std::string>;
using std::chrono::seconds;

constexpr int kSeconds = 60;
constexpr std::size_t kStates = 1000 * kSeconds;
constexpr std::size_t kImages = 30 * kSeconds;

const std::string kDomain = "29";

Program source() {
  return Program(RECORDER_SOURCE,
                 Words{"--domain", kDomain, "--period", "0.001", "--set", "joints=" + std::to_string(kStates),
                       "--set", "images=" + std::to_string(kImages)});
}

TEST(LoadVerb, AMinuteOfTwoCamerasAndAllJointsIsRecordedWhole) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  Program recorder(NIDO, Words{"record", "-o", file, "/source/*", "--json", "--domain", kDomain});
  auto writer = source();
  const auto start = std::chrono::steady_clock::now();
  ASSERT_TRUE(writer.wait_for("all written", seconds(300))) << writer.out() << writer.err();
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  writer.signal(SIGTERM);
  writer.wait();
  recorder.signal(SIGINT);
  const auto ended = recorder.wait(seconds(60));
  EXPECT_EQ(ended.code, 0) << ended.err;
  const auto report = nlohmann::json::parse(ended.out, nullptr, false);
  ASSERT_TRUE(report.is_object()) << ended.out;
  EXPECT_EQ(report["lost"], 0);
  EXPECT_EQ(report["messages"], kStates + 2 * kImages);
  std::printf("written in %.1f s; %.1f MB in the file\n", took_s, report["file_bytes"].get<double>() * 1e-6);
  auto reader = mcap::Reader::open(file);
  ASSERT_TRUE(reader.ok());
  std::map<std::string, std::uint32_t> last;
  while (const auto message = (*reader)->next()) {
    auto& sequence = last[(*reader)->channels().at(message->channel_id).topic];
    ASSERT_EQ(message->sequence, sequence + 1);
    sequence = message->sequence;
  }
  EXPECT_EQ(last["/source/joints:o"], kStates);
  EXPECT_EQ(last["/source/left:o"], kImages);
  EXPECT_EQ(last["/source/right:o"], kImages);
  EXPECT_EQ((*reader)->damage(), "");
}

TEST(LoadVerb, AKillLosesTheLastSecondAtMost) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.mcap").string();
  Program recorder(NIDO, Words{"record", "-o", file, "/source/*", "--domain", kDomain});
  auto writer = source();
  ASSERT_TRUE(writer.wait_for("begun")) << writer.out();
  // some seconds of it: how long does not matter, that it is in mid-stream does
  ASSERT_FALSE(writer.wait_for("all written", seconds(8)));
  const auto killed_ns = static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                                        std::chrono::system_clock::now().time_since_epoch())
                                                        .count());
  recorder.signal(SIGKILL);
  recorder.wait();
  auto reader = mcap::Reader::open(file);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  std::map<std::string, std::uint32_t> last;
  std::uint64_t newest_ns = 0;
  while (const auto message = (*reader)->next()) {
    auto& sequence = last[(*reader)->channels().at(message->channel_id).topic];
    ASSERT_EQ(message->sequence, sequence + 1);
    sequence = message->sequence;
    newest_ns = message->publish_time_ns;
  }
  EXPECT_GT(last["/source/joints:o"], 1000U);
  EXPECT_GT(last["/source/left:o"], 30U);
  std::printf("%.3f s before the kill are missing\n",
              (static_cast<double>(killed_ns) - static_cast<double>(newest_ns)) * 1e-9);
  EXPECT_GT(newest_ns + 1'000'000'000U, killed_ns);
}

}  // namespace
}  // namespace nido::test
