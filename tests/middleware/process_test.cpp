// Processes that end: restarted sources, signals, files left behind.

#include <dirent.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>

#include "child_process.h"
#include "nido/middleware/shm_hygiene.h"
#include "test_node.h"

namespace nido::testing {

namespace {

using msgs::String;

std::set<std::string> dds_files() {
  std::set<std::string> names;
  if (DIR* dir = opendir("/dev/shm")) {
    while (const dirent* entry = readdir(dir)) {
      const std::string name = entry->d_name;
      if (name.find("fastrtps") != std::string::npos || name.find("datasharing") != std::string::npos) {
        names.insert(name);
      }
    }
    closedir(dir);
  }
  return names;
}

// those that this process itself maps: others' come and go
std::set<std::string> own_files() {
  std::set<std::string> names;
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    if (const auto at = line.find("/dev/shm/"); at != std::string::npos) {
      names.insert(line.substr(at + 9));
    }
  }
  return names;
}

std::vector<std::string> arguments(const std::string& what) {
  return {what, "--domain", std::to_string(own_domain())};
}

TEST(Process, KilledAndRestartedSourceIsConnectedAgain) {
  auto node = make_node("watcher");
  auto in = make_input<String>(*node, "/watcher/in:i", Profile::kEvent);
  ASSERT_TRUE(in->connect("/source/count:o").ok());
  for (int life = 1; life <= 4; ++life) {
    ChildProcess source(NIDO_TEST_PEER, arguments("source"));
    ASSERT_EQ(source.line_with("READY"), "") << life;
    source.send("wait");
    ASSERT_EQ(source.line_with("CONNECTED"), "") << life;
    // the other end may learn of it a little later
    ASSERT_TRUE(in->wait_for_sources(1, kPatience_s));
    source.send("life " + std::to_string(life));
    ASSERT_TRUE(in->wait_for_message(kPatience_s)) << life;
    EXPECT_EQ(in->take()->data(), "life " + std::to_string(life) + " 1");
    source.signal(SIGKILL);
    source.wait_for_end();
  }
  EXPECT_EQ(in->connections().at(0).lost, 0U) << "a restart is no loss";
}

TEST(Process, EndsWithinASecondOfSigterm) {
  for (const char* what : {"idle", "stubborn"}) {
    ChildProcess child(NIDO_TEST_PEER, arguments(what));
    ASSERT_EQ(child.line_with("READY"), "");
    const auto begin = std::chrono::steady_clock::now();
    child.signal(SIGTERM);
    const int status = child.wait_for_end();
    const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    // half a second more for a loaded machine
    EXPECT_LT(took_s, 1.5) << what;
    EXPECT_TRUE(WIFEXITED(status)) << what;
    EXPECT_EQ(WEXITSTATUS(status), std::string(what) == "idle" ? 0 : 128 + SIGTERM) << what;
  }
}

TEST(Process, SecondSignalEndsAtOnce) {
  ChildProcess child(NIDO_TEST_PEER, arguments("stubborn"));
  ASSERT_EQ(child.line_with("READY"), "");
  child.signal(SIGINT);
  child.signal(SIGTERM);
  const int status = child.wait_for_end();
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 128 + SIGINT);
}

TEST(Process, UnknownWordsOnItsCommandLineAreRefused) {
  for (const std::vector<std::string>& bad :
       std::vector<std::vector<std::string>>{{"idle", "--colour", "red"},
                                             {"idle", "--domain", "x"},
                                             {"idle", "--set", "x"},
                                             {"idle", "--domain"}}) {
    ChildProcess child(NIDO_TEST_PEER, bad);
    const int status = child.wait_for_end();
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 2) << bad.at(1);
  }
}

TEST(Process, SweepTakesWhatAKilledProcessLeftAndNothingElse) {
  auto node = make_node("living");
  auto out = make_output<String>(*node, "/living/out:o", Profile::kState);
  const auto living = own_files();
  ASSERT_FALSE(living.empty());
  const auto before = dds_files();
  {
    ChildProcess child(NIDO_TEST_PEER, arguments("idle"));
    ASSERT_EQ(child.line_with("READY"), "");
    child.signal(SIGKILL);
    child.wait_for_end();
  }
  const auto with_leftovers = dds_files();
  std::set<std::string> leftovers;
  std::set_difference(with_leftovers.begin(), with_leftovers.end(), before.begin(), before.end(),
                      std::inserter(leftovers, leftovers.begin()));
  EXPECT_FALSE(leftovers.empty()) << "a killed process leaves files: else there is nothing to test";
  sweep_shared_memory(0.0);
  const auto after = dds_files();
  for (const std::string& name : living) {
    EXPECT_TRUE(after.contains(name)) << name << " belongs to a living process";
  }
  // the living node still talks
  auto other = make_node("other");
  auto in = make_input<String>(*other, "/other/in:i", Profile::kState);
  ASSERT_TRUE(in->connect("/living/out:o").ok());
  ASSERT_TRUE(out->write(text("still here")).ok());
  ASSERT_TRUE(in->wait_for_message(kPatience_s));
}

TEST(Process, LeavesNoFilesBehind) {
  std::set<std::string> used;
  {
    auto node = make_node("short");
    auto out = make_output<String>(*node, "/short/out:o", Profile::kState);
    ChildProcess child(NIDO_TEST_PEER, arguments("idle"));
    ASSERT_EQ(child.line_with("READY"), "");
    ASSERT_TRUE(node->call("/idle/control", "info", kPatience_s).ok());
    used = own_files();
    ASSERT_FALSE(used.empty());
    child.signal(SIGTERM);
    EXPECT_EQ(child.wait_for_end(), 0);
  }
  const auto after = dds_files();
  for (const std::string& name : used) {
    EXPECT_FALSE(after.contains(name)) << name;
    EXPECT_FALSE(after.contains("sem." + name + "_mutex")) << name;
  }
}

}  // namespace

}  // namespace nido::testing
