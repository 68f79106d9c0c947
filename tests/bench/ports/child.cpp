#include "child.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <iostream>
#include <thread>

namespace nido::bench {

Child::Child(const std::vector<std::string>& arguments) {
  int in[2];
  int out[2];
  if (pipe2(in, O_CLOEXEC) != 0) {
    return;
  }
  if (pipe2(out, O_CLOEXEC) != 0) {
    close(in[0]);
    close(in[1]);
    return;
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
  std::string program = "/proc/self/exe";
  std::vector<char*> argv{program.data()};
  for (const std::string& argument : arguments) {
    argv.push_back(const_cast<char*>(argument.c_str()));
  }
  argv.push_back(nullptr);
  if (posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environ) != 0) {
    pid_ = -1;
  }
  posix_spawn_file_actions_destroy(&actions);
  close(in[0]);
  close(out[1]);
  in_ = in[1];
  out_ = out[0];
}

Child::~Child() {
  if (in_ >= 0) {
    close(in_);
  }
  if (pid_ > 0) {
    // it ends by itself, in order; one that does not is ended
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
    while (hear(std::chrono::duration<double>(deadline - std::chrono::steady_clock::now()).count())) {
    }
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  if (out_ >= 0) {
    close(out_);
  }
}

void Child::kill_now() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }
}

void Child::say(const std::string& line) const {
  const std::string text = line + "\n";
  // a child that has ended is noticed by what it does not answer
  [[maybe_unused]] const ssize_t written = write(in_, text.data(), text.size());
}

std::optional<std::string> Child::hear(double timeout_s) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout_s);
  for (;;) {
    if (const auto end = pending_.find('\n'); end != std::string::npos) {
      std::string line = pending_.substr(0, end);
      pending_.erase(0, end + 1);
      return line;
    }
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    pollfd end{out_, POLLIN, 0};
    char buffer[65536];
    if (left.count() < 0 || poll(&end, 1, static_cast<int>(left.count())) <= 0) {
      return std::nullopt;
    }
    const ssize_t length = read(out_, buffer, sizeof buffer);
    if (length <= 0) {
      return std::nullopt;
    }
    pending_.append(buffer, static_cast<std::size_t>(length));
  }
}

void live_no_longer_than_parent() {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  std::signal(SIGPIPE, SIG_IGN);
}

void tell_parent(const std::string& line) { std::cout << line << std::endl; }

std::optional<std::string> hear_parent() {
  std::string line;
  return std::getline(std::cin, line) ? std::optional(line) : std::nullopt;
}

void end_with_parent() {
  std::thread([] {
    while (hear_parent()) {
    }
    std::_Exit(0);
  }).detach();
}

long long now_ns() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return time.tv_sec * 1'000'000'000LL + time.tv_nsec;
}

}  // namespace nido::bench
