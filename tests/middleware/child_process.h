#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <vector>

namespace nido::testing {

// A second process of a test: its standard input and output are pipes. Killed when it goes out of scope.
class ChildProcess {
 public:
  ChildProcess(const std::string& program, const std::vector<std::string>& arguments) {
    int in[2];
    int out[2];
    EXPECT_EQ(pipe2(in, O_CLOEXEC), 0);
    EXPECT_EQ(pipe2(out, O_CLOEXEC), 0);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in[0], 0);
    posix_spawn_file_actions_adddup2(&actions, out[1], 1);
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const std::string& argument : arguments) {
      argv.push_back(const_cast<char*>(argument.c_str()));
    }
    argv.push_back(nullptr);
    EXPECT_EQ(posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environ), 0) << program;
    posix_spawn_file_actions_destroy(&actions);
    close(in[0]);
    close(out[1]);
    in_ = in[1];
    out_ = out[0];
  }
  ~ChildProcess() {
    close(in_);
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    close(out_);
  }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  void send(const std::string& line) {
    const std::string text = line + "\n";
    EXPECT_EQ(write(in_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  // The rest of the first line that begins with `word`; "(none)" if it does not come.
  std::string line_with(const std::string& word, double timeout_s = 30.0) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout_s);
    for (;;) {
      for (std::size_t end = pending_.find('\n'); end != std::string::npos; end = pending_.find('\n')) {
        const std::string line = pending_.substr(0, end);
        pending_.erase(0, end + 1);
        seen_ += line + "\n";
        if (line.starts_with(word)) {
          return line.substr(word.size());
        }
      }
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
      pollfd end{out_, POLLIN, 0};
      char buffer[4096];
      if (left.count() <= 0 || poll(&end, 1, static_cast<int>(left.count())) <= 0) {
        return "(none)";
      }
      const ssize_t length = read(out_, buffer, sizeof buffer);
      if (length <= 0) {
        has_closed_ = true;
        return "(none)";
      }
      pending_.append(buffer, static_cast<std::size_t>(length));
    }
  }
  void signal(int number) const { kill(pid_, number); }
  // Its wait status, which is -1 if it does not end in time.
  int wait_for_end(double timeout_s = 30.0) {
    line_with("\x01 no such line: reads to the end", timeout_s);
    // output closes with the process
    reap(0);
    return status_;
  }
  // For messages of failures: whether it goes on, or how it ended.
  std::string fate() {
    reap(has_closed_ ? 0 : WNOHANG);
    return pid_ > 0             ? "its child goes on"
           : WIFEXITED(status_) ? "its child had ended with exit code " + std::to_string(WEXITSTATUS(status_))
           : WIFSIGNALED(status_) ? "its child was ended by signal " + std::to_string(WTERMSIG(status_))
                                  : "its child had ended";
  }
  [[nodiscard]] const std::string& seen() const { return seen_; }

 private:
  void reap(int options) {
    if (pid_ > 0 && waitpid(pid_, &status_, options) == pid_) {
      pid_ = -1;
    }
  }

  pid_t pid_ = -1;
  int status_ = -1;          // as wait gives it, once it has ended
  bool has_closed_ = false;  // its output
  int in_ = -1;
  int out_ = -1;
  std::string pending_;
  std::string seen_;
};

// How a node ends after SIGTERM: in order, or, when a busy machine does not let it within a second, by its
// own watch.
inline bool ended_on_request(int status) {
  return WIFEXITED(status) && (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 128 + SIGTERM);
}

}  // namespace nido::testing
