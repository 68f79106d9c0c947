// What a robot writes in a minute: two cameras of 640x480 at 30 Hz and 53 joints at 1 kHz. Nothing of it may
// be lost where the source itself keeps its pace; on a machine that is too busy for that, what was lost must
// be counted to the last message. A recorder that is killed loses the last second at most.
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
  const auto report = nlohmann::json::parse(ended.out, nullptr, false);
  ASSERT_TRUE(report.is_object()) << ended.out << ended.err;
  const auto lost = report["lost"].get<std::size_t>();
  std::printf("written in %.1f s; %.1f MB in the file; %zu lost\n", took_s,
              report["file_bytes"].get<double>() * 1e-6, lost);
  EXPECT_EQ(report["messages"].get<std::size_t>() + lost, kStates + 2 * kImages);
  auto reader = mcap::Reader::open(file);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->damage(), "");
  std::map<std::string, std::uint32_t> last;
  std::size_t gaps = 0;
  while (const auto message = (*reader)->next()) {
    auto& sequence = last[(*reader)->channels().at(message->channel_id).topic];
    ASSERT_GT(message->sequence, sequence);
    gaps += message->sequence - sequence - 1;
    sequence = message->sequence;
  }
  EXPECT_EQ(gaps, lost);
  if (took_s > 1.1 * kSeconds) GTEST_SKIP() << "this machine is too busy for the source itself";
  EXPECT_EQ(lost, 0U);
  EXPECT_EQ(ended.code, 0) << ended.err;
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
    ASSERT_GT(message->sequence, sequence);
    sequence = message->sequence;
    newest_ns = message->publish_time_ns;
  }
  EXPECT_GT(last["/source/joints:o"], 100U);
  EXPECT_GT(last["/source/left:o"], 10U);
  std::printf("%.3f s before the kill are missing\n",
              (static_cast<double>(killed_ns) - static_cast<double>(newest_ns)) * 1e-9);
  EXPECT_GT(newest_ns + 1'000'000'000U, killed_ns);
}

}  // namespace
}  // namespace nido::test
