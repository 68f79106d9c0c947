// A launcher that is killed leaves no process.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <thread>

#include "nido/launcher/child.h"
#include "temp_folder.h"

namespace nido {
namespace {
namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

// Waits for a condition about other processes, of which no event tells.
bool becomes_true(const std::function<bool()>& condition, seconds limit = seconds(15)) {
  const auto until = steady_clock::now() + limit;
  while (!condition()) {
    if (steady_clock::now() > until) return false;
    std::this_thread::sleep_for(milliseconds(10));
  }
  return true;
}

// Living processes whose command line is that program's.
int count_of(const std::string& program) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    std::error_code error;
    if (fs::read_symlink(entry.path() / "exe", error) == program) ++count;
  }
  return count;
}

class KilledLauncher : public testing::Test {
 protected:
  // Starts a supervising process; returns when its children are up.
  void launch(const std::vector<std::string>& modes) {
    ChildCommand command;
    command.program = TEST_PARENT;
    command.arguments = {JANITOR, TEST_CHILD};
    command.arguments.insert(command.arguments.end(), modes.begin(), modes.end());
    auto child = spawn(command);
    ASSERT_TRUE(child.ok()) << child.error().message;
    launcher_ = child->pid;
    fcntl(child->output_fd, F_SETFL, 0);
    std::string text;
    char c = 0;
    while (text.find("all\n") == std::string::npos && read(child->output_fd, &c, 1) == 1) text += c;
    ASSERT_NE(text.find("all\n"), std::string::npos) << text;
    close(child->output_fd);
    if (child->pidfd >= 0) close(child->pidfd);
    for (std::size_t from = 0, end = 0; (end = text.find('\n', from)) != std::string::npos; from = end + 1) {
      if (text.compare(from, 3, "all") != 0) pids_.push_back(std::stoi(text.substr(from, end - from)));
    }
  }
  void end_launcher(int number) {
    kill(launcher_, number);
    int status = 0;
    waitpid(launcher_, &status, 0);
  }
  bool all_gone() const {
    return std::all_of(pids_.begin(), pids_.end(), [](pid_t pid) { return start_time_of(pid) == 0; });
  }
  pid_t launcher_ = -1;
  std::vector<pid_t> pids_;
};

TEST_F(KilledLauncher, LeavesNoChild) {
  const int janitors = count_of(fs::canonical(JANITOR));
  launch({"wait", "wait"});
  EXPECT_EQ(pids_.size(), 2U);
  EXPECT_TRUE(becomes_true([&] { return count_of(fs::canonical(JANITOR)) == janitors + 1; }));
  end_launcher(SIGKILL);
  const auto start = steady_clock::now();
  EXPECT_TRUE(becomes_true([this] { return all_gone(); }));
  EXPECT_TRUE(becomes_true([&] { return count_of(fs::canonical(JANITOR)) == janitors; }));
  EXPECT_LT(steady_clock::now() - start, seconds(5));
}

TEST_F(KilledLauncher, LeavesNoStubbornChildNorGrandchild) {
  launch({"stubborn", "grandchild", "wait"});
  EXPECT_EQ(pids_.size(), 4U);
  const auto start = steady_clock::now();
  end_launcher(SIGKILL);
  EXPECT_TRUE(becomes_true([this] { return all_gone(); }));
  EXPECT_LT(steady_clock::now() - start, seconds(5));
}

}  // namespace
}  // namespace nido
