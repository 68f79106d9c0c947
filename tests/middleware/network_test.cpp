// More than one computer: settings, and two network namespaces joined by a cable.
#include "nido/middleware/network.h"

#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "child_process.h"
#include "nido/middleware/key_store.h"
#include "slow_cable.h"
#include "test_node.h"

namespace nido::testing {

namespace {

std::string written_to_file(const std::string& name, const std::string& text) {
  const std::string file = ::testing::TempDir() + "nido-network-" + std::to_string(getpid()) + "-" + name;
  std::ofstream(file) << text;
  return file;
}

TEST(Network, TheSettingsOfAFile) {
  const std::string file = written_to_file(
      "good.yaml",
      "interface: lo\npeers: [192.168.7.3, 192.168.7.4]\nsecurity: none\nprocesses_per_computer: 5\n"
      "repair_pictures: true\n");
  const auto settings = read_network_settings(file);
  ASSERT_TRUE(settings.ok()) << settings.error().message;
  EXPECT_EQ(settings->interface_name, "lo");
  EXPECT_EQ(settings->address, "127.0.0.1");
  EXPECT_EQ(settings->peers, (std::vector<std::string>{"192.168.7.3", "192.168.7.4"}));
  EXPECT_EQ(settings->processes_per_computer, 5);
  EXPECT_EQ(settings->largest_packet_bytes, 1400);
  EXPECT_TRUE(settings->repair_pictures);
  unlink(file.c_str());
}

TEST(Network, WhatIsNotUnderstoodIsRefusedWithItsPlace) {
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"peers: []\nsecurity: none\n", ":1: the key interface is missing"},
      {"interface: lo\n", ":1: the key security is missing"},
      {"interface: nowhere7\nsecurity: none\n", ":1: there is no interface 'nowhere7'; there are"},
      {"interface: lo\nsecurity: none\npeers: 192.168.7.3\n", ":3: peers is a list"},
      {"interface: lo\nsecurity: none\npeers: [desk]\n", ":3: peer 'desk' is not an IPv4 address"},
      {"interface: lo\nsecurity: none\ncolour: red\n", ":3: 'colour' is not allowed; there are interface"},
      {"interface: lo\nsecurity: none\nprocesses_per_computer: 0\n",
       ":3: processes_per_computer is 0, allowed is 1"},
      {"interface: lo\nsecurity: none\nlargest_packet_bytes: many\n", ":3: 'many' is not understood"},
      {"interface: lo\nsecurity: none\nrepair_pictures: 3\n", ":3: '3' is not understood"},
      {"interface: lo\nsecurity: keys\nlargest_packet_bytes: 1400\n",
       ":3: largest_packet_bytes is 1400, with keys 8000 at least"},
      {"interface: [lo]\nsecurity: none\n", ":1: '[lo]' is not understood"},
      {"7\n", "holds no 'key: value' lines"},
      {"a: [\n", "network file"}};
  for (const auto& [text, sentence] : bad) {
    const std::string file = written_to_file("bad.yaml", text);
    const auto settings = read_network_settings(file);
    ASSERT_FALSE(settings.ok()) << text;
    EXPECT_NE(settings.error().message.find(sentence), std::string::npos) << settings.error().message;
    EXPECT_EQ(settings.error().code, ErrorCode::kInvalidArgument);
    unlink(file.c_str());
  }
  EXPECT_EQ(read_network_settings("/no/such/file.yaml").error().code, ErrorCode::kNotFound);
}

bool run(const std::string& command) { return std::system((command + " 2>/dev/null").c_str()) == 0; }

// Two namespaces that know each other by one cable, without a multicast route. Needs root and iproute2.
class TwoComputers : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!run("ip netns add " + name('a')) || !run("ip netns add " + name('b'))) {
      GTEST_SKIP() << "network namespaces cannot be made here: that takes root and iproute2";
    }
    if (!lay_cable()) {
      GTEST_SKIP() << "this kernel has no such cable";
    }
    for (const char which : {'a', 'b'}) {
      ASSERT_TRUE(run("ip -n " + name(which) + " addr add " + address(which) + "/24 dev cable"));
      ASSERT_TRUE(run("ip -n " + name(which) + " link set lo up"));
      ASSERT_TRUE(run("ip -n " + name(which) + " link set cable up"));
      configure(which, "security: none");
    }
    for (const char which : {'a', 'b'}) {
      ASSERT_TRUE(gets_link(which));
    }
  }
  void TearDown() override {
    run("ip netns del " + name('a'));
    run("ip netns del " + name('b'));
    for (const auto& entry : settings_) {
      unlink(entry.second.c_str());
    }
  }
  // The network file of a computer: who the other is, and these lines.
  void configure(char which, const std::string& lines) {
    settings_[which] = written_to_file(
        std::string(1, which) + ".yaml",
        "interface: cable\npeers: [" + address(which == 'a' ? 'b' : 'a') + "]\n" + lines + "\n");
  }
  void set_security(char which, const std::string& keys) { configure(which, "security: " + keys); }
  static bool gets_link(char which) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < until) {
      if (run("ip -n " + name(which) + " link show cable | grep -q LOWER_UP")) {
        return true;
      }
    }
    return false;
  }
  virtual bool lay_cable() {
    return run("ip link add name cable netns " + name('a') + " type veth peer name cable netns " + name('b'));
  }
  static std::string name(char which) { return "nido-test-" + std::to_string(getpid()) + "-" + which; }
  static std::string address(char which) { return which == 'a' ? "192.168.77.1" : "192.168.77.2"; }

  std::unique_ptr<ChildProcess> start(char where, const std::vector<std::string>& words) {
    // env finds ip, wherever it is
    std::vector<std::string> arguments{
        "ip", "netns", "exec", name(where), "env", "NIDO_NETWORK=" + settings_[where], NIDO_TEST_PEER};
    arguments.insert(arguments.end(), words.begin(), words.end());
    arguments.insert(arguments.end(), {"--domain", std::to_string(own_domain())});
    return std::make_unique<ChildProcess>("/usr/bin/env", arguments);
  }

 private:
  std::map<char, std::string> settings_;
};

// 20 ms each way, and one packet in ten is lost each way
class FarComputers : public TwoComputers {
 protected:
  bool lay_cable() override {
    cable_ = std::make_unique<SlowCable>(name('a'), name('b'), std::chrono::milliseconds(20), 0.1);
    return cable_->is_plugged();
  }
  // 500 commands, and the pictures of two cameras that the same thread writes at 30 Hz. Goes on until that
  // many `pictures` have come, too, so the giver has more to give.
  void expect_commands(int pictures) {
    const std::string given = pictures > 0 ? "count=20000" : "count=500";
    auto giver = start('a', {"giver", "--set", given, "--set", "cameras=2"});
    auto taker = start('b', {"taker", "--connect", "/giver/command:o=/taker/command:i", "--set", "count=500",
                             "--set", "cameras=2", "--set", "pictures=" + std::to_string(pictures)});
    ASSERT_EQ(giver->line_with("CONNECTED"), "") << giver->seen();
    ASSERT_EQ(taker->line_with("READY"), "") << taker->seen();
    giver->send("go");
    const std::string delay = taker->line_with("DELAY_MS ");
    RecordProperty("delay_ms", delay);
    std::printf("delay in ms: %s\n", delay.c_str());
    EXPECT_EQ(delay.find("broken"), std::string::npos) << delay;
    EXPECT_EQ(taker->line_with("TAKEN "), "500 in order") << taker->seen();
    if (pictures == 0) {
      std::printf("%s\n", giver->line_with("GIVEN ").c_str());
    }
    std::printf("%d packets carried, %d lost; the cable itself was late by %.1f ms at most\n",
                cable_->carried(), cable_->lost(), cable_->latest_ms());
    EXPECT_GT(cable_->lost(), 0);
  }
  std::unique_ptr<SlowCable> cable_;
};

TEST_F(FarComputers, EveryCommandArrivesOnceAndInOrder) { expect_commands(0); }

// Of 165 packets of a picture some are lost each time: without repair none would come.
TEST_F(FarComputers, PicturesAreRepairedBesideCommands) {
  for (const char which : {'a', 'b'}) {
    configure(which, "security: none\nrepair_pictures: true");
  }
  expect_commands(10);
}

TEST_F(TwoComputers, ALockstepGoesOverTheCable) {
  auto owner = start('a', {"owner", "--clock", "lockstep", "--set", "lockstep.nodes=[far]", "--set",
                           "ticks=100", "--connect", "/far/out:o=/owner/in:i"});
  auto member =
      start('b', {"member", "--name", "far", "--clock", "lockstep", "--connect", "/owner/out:o=/far/in:i"});
  EXPECT_NE(owner->line_with("HASH "), "(none)") << owner->seen();
  member->signal(SIGTERM);
  EXPECT_TRUE(member->line_with("HASH ").ends_with(" 100")) << member->seen();
  EXPECT_EQ(owner->seen().find("ended without leaving"), std::string::npos) << owner->seen();
}

// A folder of keys for a test, removed with it.
class Keys {
 public:
  explicit Keys(const std::string& name)
      : folder_(::testing::TempDir() + "nido-keys-" + std::to_string(getpid()) + "-" + name) {
    std::filesystem::remove_all(folder_);
    const Status made = make_key_store(folder_);
    EXPECT_TRUE(made.ok()) << made.error().message;
  }
  ~Keys() { std::filesystem::remove_all(folder_); }
  Keys(const Keys&) = delete;
  Keys& operator=(const Keys&) = delete;
  [[nodiscard]] const std::string& folder() const { return folder_; }

 private:
  const std::string folder_;
};

TEST(Keys, AreMadeOnceAndOnlyForNodes) {
  const Keys keys("once");
  EXPECT_EQ(make_key_store(keys.folder()).error().code, ErrorCode::kTaken);
  EXPECT_TRUE(add_identity(keys.folder(), "watcher", {.read = {"/icubSim/*"}}).ok());
  EXPECT_EQ(add_identity(keys.folder(), "watcher", {}).error().code, ErrorCode::kTaken);
  EXPECT_EQ(add_identity(keys.folder(), "no node", {}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(add_identity(keys.folder(), "other", {.write = {"no port"}}).error().code,
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(add_identity("/no/such/folder", "other", {}).error().code, ErrorCode::kNotFound);
  using Perms = std::filesystem::perms;
  const auto secret = std::filesystem::status(keys.folder() + "/authority/key.pem").permissions();
  EXPECT_EQ(secret & (Perms::group_all | Perms::others_all), Perms::none);
}

TEST_F(TwoComputers, OnlyThoseWithKeysOfTheSameAuthorityHearEachOther) {
  const Keys keys("ours");
  const Keys others("theirs");
  ASSERT_TRUE(add_identity(keys.folder(), "watcher", {.read = {"/source/*"}}).ok());
  set_security('a', keys.folder());
  set_security('b', keys.folder());
  auto source = start('a', {"source"});
  ASSERT_EQ(source->line_with("READY"), "") << source->seen();
  const std::vector<std::string> listener_words{"listener", "--connect", "/source/count:o=/listener/in:i"};
  auto listener = start('b', listener_words);
  ASSERT_EQ(listener->line_with("READY"), "") << listener->seen();
  source->send("wait");
  ASSERT_EQ(source->line_with("CONNECTED"), "");
  source->send("secret");
  EXPECT_EQ(listener->line_with("GOT "), "secret 1");
  listener.reset();
  // a node with an identity of its own may do no more than that says
  auto watcher = start('b', {"idle", "--name", "watcher"});
  EXPECT_NE(watcher->line_with("[watcher] error: port /idle/out:o cannot be made"), "(none)");
  for (const std::string& foreign : {others.folder(), std::string("none")}) {
    set_security('b', foreign);
    auto stranger =
        start('b', {"listener", "--connect", "/source/count:o=/listener/in:i", "--set", "patience_s=4"});
    EXPECT_EQ(stranger->line_with("[listener] error: "), "no source") << foreign;
  }
}

TEST_F(TwoComputers, ACableThatWasPulledHealsByItself) {
  auto source = start('a', {"source"});
  auto listener = start('b', {"listener", "--connect", "/source/count:o=/listener/in:i"});
  ASSERT_EQ(listener->line_with("READY"), "") << listener->seen();
  source->send("wait");
  ASSERT_EQ(source->line_with("CONNECTED"), "");
  source->send("before");
  ASSERT_EQ(listener->line_with("GOT "), "before 1");
  ASSERT_TRUE(run("ip -n " + name('a') + " link set cable down"));
  // longer than the lease: both have forgotten each other
  std::this_thread::sleep_for(std::chrono::seconds(5));
  ASSERT_TRUE(run("ip -n " + name('a') + " link set cable up"));
  const auto up = std::chrono::steady_clock::now();
  std::string got = "(none)";
  for (int i = 0; i < 100 && got == "(none)"; ++i) {
    source->send("after");
    got = listener->line_with("GOT after", 0.2);
  }
  std::printf("healed after %.2f s\n",
              std::chrono::duration<double>(std::chrono::steady_clock::now() - up).count());
  EXPECT_NE(got, "(none)") << listener->seen();
}

}  // namespace

}  // namespace nido::testing
