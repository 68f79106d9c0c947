// Keys of a run in a terminal.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <csignal>

#include "temp_folder.h"
#include "tool.h"

namespace nido::test {
namespace {

// `nido` with these words in a terminal of its own.
class Terminal {
 public:
  explicit Terminal(std::vector<std::string> words) {
    words.insert(words.begin(), NIDO);
    std::vector<char*> argv;
    for (auto& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    pid_ = forkpty(&screen_, nullptr, nullptr, nullptr);
    if (pid_ == 0) {
      execv(NIDO, argv.data());
      _exit(127);
    }
  }
  ~Terminal() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    close(screen_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  void press(char key) const { ASSERT_EQ(write(screen_, &key, 1), 1); }
  [[nodiscard]] bool shows(const std::string& text) {
    return becomes_true(
        [&] {
          pollfd waiting{screen_, POLLIN, 0};
          char piece[4096];
          while (poll(&waiting, 1, 0) == 1) {
            const ssize_t size = read(screen_, piece, sizeof piece);
            if (size <= 0) break;
            seen_.append(piece, static_cast<std::size_t>(size));
          }
          return seen_.find(text) != std::string::npos;
        },
        std::chrono::seconds(60));
  }
  [[nodiscard]] bool is_by_lines() const {
    termios mode{};
    tcgetattr(screen_, &mode);
    return (mode.c_lflag & ICANON) != 0 && (mode.c_lflag & ECHO) != 0;
  }
  [[nodiscard]] const std::string& seen() const { return seen_; }

 private:
  pid_t pid_ = -1;
  int screen_ = -1;
  std::string seen_;
};

TEST(LaunchKeys, TheSpaceBarStopsTheRobotsAndTheTerminalIsLeftAsItWas) {
  TempFolder folder;
  const std::string app = folder.write(
      "small.yaml", std::string("name: small\nsummary: a small app\nprocesses:\n  - {program: ") + TEST_NODE +
                        ", name: robot, clock: owner, parameters: {behaviour: clock}}\n");
  Terminal terminal(
      {"launch", app, "--out", (folder.path() / "out").string(), "--domain", std::to_string(test_domain())});
  ASSERT_TRUE(terminal.shows("the space bar is the emergency stop")) << terminal.seen();
  ASSERT_TRUE(terminal.shows("1 processes are ready")) << terminal.seen();
  terminal.press('x');
  terminal.press(' ');
  EXPECT_TRUE(terminal.shows("'robot' takes no command until 'nido node call robot estop clear'"))
      << terminal.seen();
  EXPECT_FALSE(terminal.is_by_lines());
  terminal.press('\x03');
  EXPECT_TRUE(terminal.shows("stopped by Ctrl-C")) << terminal.seen();
  EXPECT_TRUE(becomes_true([&] { return terminal.is_by_lines(); }));
}

}  // namespace
}  // namespace nido::test
