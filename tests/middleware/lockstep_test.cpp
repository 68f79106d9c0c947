#include <map>

#include "child_process.h"
#include "test_node.h"

namespace nido::testing {

namespace {

// Runs an owner and members that all talk to all; what each of them saw, by name.
std::map<std::string, std::string> run_lockstep(int members, int ticks, int jitter_us,
                                                double* us_per_tick = nullptr) {
  std::map<std::string, std::string> hashes;
  std::vector<std::unique_ptr<ChildProcess>> children;
  std::string names;
  for (int i = 0; i < members; ++i) {
    names += (i == 0 ? "" : ", ") + ("m" + std::to_string(i));
  }
  std::vector<std::string> common{"--domain", std::to_string(own_domain()), "--clock", "lockstep"};
  std::vector<std::string> owner_args{"owner", "--set", "lockstep.nodes=[" + names + "]", "--set",
                                      "ticks=" + std::to_string(ticks)};
  owner_args.insert(owner_args.end(), common.begin(), common.end());
  for (int i = 0; i < members; ++i) {
    const std::string name = "m" + std::to_string(i);
    std::vector<std::string> arguments{"member", "--name", name, "--set",
                                       "jitter_us=" + std::to_string(jitter_us)};
    arguments.insert(arguments.end(), common.begin(), common.end());
    // one in three is slower than the tick
    if (i % 3 == 2) {
      arguments.insert(arguments.end(), {"--period", "0.0333"});
    }
    for (int other = 0; other < members; ++other) {
      if (other != i) {
        for (const char* port : {"out", "state", "command"}) {
          if (std::string(port) != "state") {
            arguments.insert(arguments.end(), {"--connect", "/m" + std::to_string(other) + "/" + port +
                                                                ":o=/" + name + "/in:i"});
          }
        }
      }
    }
    arguments.insert(arguments.end(), {"--connect", "/owner/out:o=/" + name + "/in:i"});
    owner_args.insert(owner_args.end(), {"--connect", "/" + name + "/out:o=/owner/in:i"});
    children.push_back(std::make_unique<ChildProcess>(NIDO_TEST_PEER, arguments));
  }
  ChildProcess owner(NIDO_TEST_PEER, owner_args);
  hashes["owner"] = owner.line_with("HASH ", 90.0);
  const std::string per_tick = owner.line_with("US_PER_TICK ");
  if (us_per_tick != nullptr) {
    *us_per_tick = std::stod(per_tick == "(none)" ? "1e9" : per_tick);
  }
  for (int i = 0; i < members; ++i) {
    children[static_cast<std::size_t>(i)]->signal(SIGTERM);
    hashes["m" + std::to_string(i)] = children[static_cast<std::size_t>(i)]->line_with("HASH ");
  }
  EXPECT_EQ(owner.wait_for_end(), 0) << owner.seen();
  return hashes;
}

TEST(Lockstep, IsRepeatableBitForBit) {
  const auto first = run_lockstep(3, 200, 2000);
  const auto second = run_lockstep(3, 200, 500);
  EXPECT_EQ(first, second);
  EXPECT_EQ(first.size(), 4U);
  for (const auto& [name, hash] : first) {
    EXPECT_NE(hash, "(none)") << name;
  }
  EXPECT_NE(first.at("m0"), first.at("m1"));
}

TEST(Lockstep, SixNodesStepTogether) {
  double us_per_tick = 1e9;
  run_lockstep(6, 2000, 0, &us_per_tick);
  RecordProperty("us_per_tick", std::to_string(us_per_tick));
  std::printf("barrier round of 6 nodes: %.0f us\n", us_per_tick);
}

std::vector<std::string> lockstep_arguments(const std::string& what, const std::vector<std::string>& more) {
  std::vector<std::string> arguments{what, "--domain", std::to_string(own_domain()), "--clock", "lockstep"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST(Lockstep, AKilledMemberIsLeftBehindAndCanJoinAgain) {
  const std::vector<std::string> steady{"--name",         "steady",    "--set",
                                        "jitter_us=1000", "--connect", "/fragile/out:o=/steady/in:i"};
  const std::vector<std::string> fragile{"--name", "fragile", "--connect", "/owner/out:o=/fragile/in:i"};
  ChildProcess owner(NIDO_TEST_PEER, lockstep_arguments("owner", {"--set", "lockstep.nodes=[steady, fragile]",
                                                                  "--set", "ticks=100000"}));
  ChildProcess member(NIDO_TEST_PEER, lockstep_arguments("member", steady));
  {
    ChildProcess victim(NIDO_TEST_PEER, lockstep_arguments("member", fragile));
    ASSERT_EQ(owner.line_with("TICKING"), "");
    victim.signal(SIGKILL);
    victim.wait_for_end();
  }
  EXPECT_NE(owner.line_with("[owner] warning: node fragile ended without leaving the lockstep"), "(none)")
      << owner.seen();
  ChildProcess again(NIDO_TEST_PEER, lockstep_arguments("member", fragile));
  EXPECT_EQ(again.line_with("TICKING"), "") << "the second life works again";
  // a polite end needs no warning
  again.signal(SIGTERM);
  EXPECT_NE(again.line_with("HASH "), "(none)");
  EXPECT_TRUE(ended_on_request(again.wait_for_end()));
  owner.signal(SIGTERM);
  EXPECT_TRUE(ended_on_request(owner.wait_for_end()));
  EXPECT_EQ(owner.seen().find("fragile ended", owner.seen().find("fragile ended") + 1), std::string::npos)
      << owner.seen();
}

TEST(Lockstep, TheFirstTickWaitsForEveryExpectedNodeAndSaysForWhom) {
  ChildProcess owner(NIDO_TEST_PEER,
                     lockstep_arguments("owner", {"--set", "lockstep.nodes=[late]", "--set", "ticks=20"}));
  EXPECT_EQ(owner.line_with("[owner] info: waits with the first tick: "), "node late is not there");
  ChildProcess late(NIDO_TEST_PEER, lockstep_arguments("member", {"--name", "late"}));
  EXPECT_NE(owner.line_with("HASH "), "(none)");
  late.signal(SIGTERM);
  // it has seen every tick
  EXPECT_TRUE(late.line_with("HASH ").ends_with(" 20"));
}

TEST(Lockstep, AMemberThatHangsEndsTheRunWithItsName) {
  ChildProcess owner(NIDO_TEST_PEER,
                     lockstep_arguments("owner", {"--set", "lockstep.nodes=[sleeper]", "--set",
                                                  "ticks=1000000", "--set", "lockstep.patience_s=1"}));
  ChildProcess sleeper(NIDO_TEST_PEER, lockstep_arguments("member", {"--name", "sleeper"}));
  ASSERT_EQ(owner.line_with("TICKING"), "");
  sleeper.signal(SIGSTOP);
  const int status = owner.wait_for_end();
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 3);
  EXPECT_NE(owner.seen().find("for node sleeper, which lives but has not finished tick"), std::string::npos)
      << owner.seen();
}

// A machine can be so busy that a process gets no turn for seconds; nobody may forget it for that.
TEST(Lockstep, AMemberThatGetsNoTurnForSecondsGoesOnAndMissesNothing) {
  ChildProcess owner(NIDO_TEST_PEER,
                     lockstep_arguments("owner", {"--set", "lockstep.nodes=[sleeper, other]", "--set",
                                                  "ticks=400", "--connect", "/sleeper/out:o=/owner/in:i"}));
  ChildProcess sleeper(
      NIDO_TEST_PEER,
      lockstep_arguments("member", {"--name", "sleeper", "--connect", "/owner/out:o=/sleeper/in:i",
                                    "--connect", "/other/out:o=/sleeper/in:i"}));
  ChildProcess other(NIDO_TEST_PEER, lockstep_arguments("member", {"--name", "other", "--connect",
                                                                   "/sleeper/out:o=/other/in:i"}));
  ASSERT_EQ(owner.line_with("TICKING"), "");
  sleeper.signal(SIGSTOP);
  ASSERT_EQ(owner.line_with("[owner] info: waits since 4 s for "), "sleeper");
  sleeper.signal(SIGCONT);
  EXPECT_NE(owner.line_with("HASH "), "(none)");
  for (ChildProcess* member : {&sleeper, &other}) {
    member->signal(SIGTERM);
    EXPECT_TRUE(member->line_with("HASH ").ends_with(" 400"));
  }
  const std::string all = owner.seen() + sleeper.seen() + other.seen();
  EXPECT_EQ(all.find("lost sight"), std::string::npos) << all;
}

TEST(Lockstep, MoreMessagesInATickThanAreKeptAreRefused) {
  NodeOptions options = options_of("owner");
  options.clock = ClockMode::kLockstep;
  auto node = make_node(options);
  auto event = make_output<msgs::String>(*node, "/owner/event:o", Profile::kEvent, 20);
  for (int tick = 1; tick <= 3; ++tick) {
    ASSERT_TRUE(node->publish_clock(Time{tick * 10'000'000LL}).ok());
    for (int i = 0; i < 20; ++i) {
      ASSERT_TRUE(event->write(text("message")).ok()) << tick << " " << i;
    }
    const Status refused = event->write(text("one too many"));
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.error().message.find("/owner/event:o has written 20 messages in one tick"),
              std::string::npos)
        << refused.error().message;
  }
}

TEST(Lockstep, ImagesArriveInTheirTickAndOnesBeforeTheFirstTickAreNotWaitedFor) {
  std::vector<std::string> hashes;
  for (int run = 0; run < 2; ++run) {
    ChildProcess owner(NIDO_TEST_PEER, lockstep_arguments("owner", {"--set", "lockstep.nodes=[viewer]",
                                                                    "--set", "ticks=301"}));
    // it has written already when the viewer comes
    EXPECT_NE(owner.line_with("[owner] info: waits with the first tick: "), "(none)");
    ChildProcess viewer(NIDO_TEST_PEER,
                        lockstep_arguments("viewer", {"--connect", "/owner/image:o=/viewer/left:i",
                                                      "--connect", "/owner/image2:o=/viewer/right:i"}));
    EXPECT_NE(owner.line_with("HASH "), "(none)");
    viewer.signal(SIGTERM);
    hashes.push_back(viewer.line_with("HASH "));
    EXPECT_EQ(viewer.seen().find("warning"), std::string::npos) << viewer.seen();
  }
  EXPECT_EQ(hashes.at(0), hashes.at(1));
  EXPECT_TRUE(hashes.at(0).ends_with(" 100")) << hashes.at(0);
}

}  // namespace

}  // namespace nido::testing
