// Processes that end: restarted sources, signals, files left behind.

#include <fcntl.h>
#include <sys/socket.h>

#include <array>
#include <fstream>
#include <set>

#include "child_process.h"
#include "fd.h"
#include "nido/middleware/shm_hygiene.h"
#include "test_node.h"

namespace nido::testing {

namespace {

using msgs::String;

// files in /dev/shm that a process maps
std::set<std::string> mapped_files(pid_t pid) {
  std::set<std::string> names;
  std::ifstream maps("/proc/" + std::to_string(pid) + "/maps");
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

// A process that dies while it works on a message leaves its end of the way to it as if it were alive: what
// others knew of that way must not be used for its next life.
TEST(Process, AReaderThatDiesAtAMessageIsServedInItsNextLife) {
  auto node = make_node("writer");
  auto out = make_output<String>(*node, "/writer/out:o", Profile::kState);
  std::vector<std::string> words = arguments("listener");
  words.insert(words.end(), {"--connect", "/writer/out:o=/listener/in:i", "--set", "state=true"});
  for (int life = 1; life <= 5; ++life) {
    ChildProcess listener(NIDO_TEST_PEER, words);
    ASSERT_EQ(listener.line_with("READY"), "") << life;
    const std::string word = "life " + std::to_string(life);
    ASSERT_TRUE(out->write(text(word)).ok());
    std::string got;
    while (got != word && got != "(none)") {
      got = listener.line_with("GOT ");
    }
    ASSERT_EQ(got, word);
    ASSERT_TRUE(out->write(text("die")).ok());
    EXPECT_NE(listener.wait_for_end(), -1);
    ASSERT_TRUE(out->write(text("nobody is there")).ok());
  }
}

TEST(Process, AStoppedReaderHoldsUpNobodyAndIsServedWhenItGoesOn) {
  auto node = make_node("writer");
  auto out = make_output<String>(*node, "/writer/out:o", Profile::kEvent, 4);
  auto other = make_node("other");
  auto in = make_input<String>(*other, "/other/in:i", Profile::kEvent, 10000);
  ASSERT_TRUE(in->connect("/writer/out:o").ok());
  std::vector<std::string> words = arguments("listener");
  words.insert(words.end(), {"--connect", "/writer/out:o=/listener/in:i"});
  ChildProcess stopped(NIDO_TEST_PEER, words);
  ASSERT_EQ(stopped.line_with("READY"), "");
  ASSERT_TRUE(out->wait_for_readers(2, kPatience_s));
  ASSERT_TRUE(in->wait_for_sources(1, kPatience_s));
  stopped.signal(SIGSTOP);
  // more than any buffer between the two takes
  const std::string load(50000, 'x');
  for (int i = 0; i < 300; ++i) {
    ASSERT_TRUE(out->write(text(load)).ok());
    ASSERT_TRUE(in->wait_for_message(kPatience_s)) << "message " << i << " for the one that goes on";
    while (in->take()) {
    }
  }
  stopped.signal(SIGCONT);
  // what was written meanwhile may be lost to it, what comes now is not
  std::string got;
  for (int i = 0; i < 200 && got != "the end"; ++i) {
    ASSERT_TRUE(out->write(text("the end")).ok());
    got = stopped.line_with("GOT the end", 0.1) == "(none)" ? "" : "the end";
  }
  EXPECT_EQ(got, "the end") << stopped.fate() << "; it said last:\n" << stopped.seen();
}

// A process that is being started has a copy of each file of this one for a moment. Here for longer.
class HolderOfCopies {
 public:
  HolderOfCopies() : pid_(fork()) {
    if (pid_ == 0) {
      for (;;) {
        pause();
      }
    }
  }
  ~HolderOfCopies() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  HolderOfCopies(const HolderOfCopies&) = delete;
  HolderOfCopies& operator=(const HolderOfCopies&) = delete;

 private:
  const pid_t pid_;
};

TEST(Process, WhatComesForOthersIsNotReadWhenAProcessEndsWhileAnotherIsStarted) {
  auto node = make_node("watcher");
  auto in = make_input<String>(*node, "/watcher/in:i", Profile::kState);
  ASSERT_TRUE(in->connect("/idle/out:o").ok());
  ChildProcess ending(NIDO_TEST_PEER, arguments("idle"));
  ASSERT_EQ(ending.line_with("READY"), "");
  ASSERT_TRUE(in->wait_for_sources(1, kPatience_s));
  const HolderOfCopies holder;
  ending.signal(SIGKILL);
  ending.wait_for_end();
  // these get the numbers of the files that its end closes
  struct Pair {
    Fd in;
    Fd out;
  };
  std::vector<Pair> pairs;
  const auto make_pairs = [&] {
    for (int i = 0; i < 20; ++i) {
      int ends[2];
      ASSERT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends), 0);
      pairs.push_back({Fd(ends[0]), Fd(ends[1])});
      ASSERT_EQ(write(ends[1], "mine", 4), 4);
      ASSERT_EQ(write(ends[0], "mine", 4), 4);
    }
  };
  for (int life = 0; life < 3; ++life) {
    make_pairs();
    // somebody else comes, so that the threads that listen have gone on
    ChildProcess next(NIDO_TEST_PEER, arguments("idle"));
    ASSERT_EQ(next.line_with("READY"), "");
    ASSERT_TRUE(in->wait_for_sources(1, kPatience_s));
    next.signal(SIGKILL);
    next.wait_for_end();
  }
  int taken = 0;
  for (const Pair& pair : pairs) {
    for (const int fd : {pair.in.get(), pair.out.get()}) {
      std::array<char, 8> text{};
      taken += recv(fd, text.data(), text.size(), MSG_DONTWAIT) == 4 ? 0 : 1;
    }
  }
  EXPECT_EQ(taken, 0);
}

TEST(Process, NothingIsLeftInSharedMemoryAlsoByAKilledProcess) {
  auto node = make_node("living");
  auto in = make_input<String>(*node, "/living/in:i", Profile::kState);
  ASSERT_TRUE(in->connect("/idle/out:o").ok());
  ChildProcess child(NIDO_TEST_PEER, arguments("idle"));
  ASSERT_EQ(child.line_with("READY"), "");
  ASSERT_TRUE(in->wait_for_sources(1, kPatience_s));
  EXPECT_EQ(mapped_files(getpid()), std::set<std::string>());
  EXPECT_EQ(mapped_files(child.pid()), std::set<std::string>());
}

TEST(Process, SweepTakesWhatADeadProgramLeftAndNothingElse) {
  const std::string name = "fastrtps_of_nido_test_" + std::to_string(getpid());
  const auto make = [](const std::string& path) { return open(path.c_str(), O_CREAT | O_RDWR, 0600); };
  const int held = make("/dev/shm/" + name + "_held");
  ASSERT_GE(held, 0) << "/dev/shm cannot be written";
  close(make("/dev/shm/" + name + "_left"));
  sweep_shared_memory(0.0);
  EXPECT_EQ(access(("/dev/shm/" + name + "_held").c_str(), F_OK), 0) << "somebody has it open";
  EXPECT_NE(access(("/dev/shm/" + name + "_left").c_str(), F_OK), 0);
  close(held);
  sweep_shared_memory(0.0);
  EXPECT_NE(access(("/dev/shm/" + name + "_held").c_str(), F_OK), 0);
}

}  // namespace

}  // namespace nido::testing
