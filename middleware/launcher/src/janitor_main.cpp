// nido-janitor: outlives a launcher that was killed. Reads on stdin which processes live ("+PID START",
// "-PID", "done"). When the pipe closes without "done", the launcher was killed: the processes got SIGTERM
// from the kernel then; what still lives after two seconds is killed with its group.
#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <map>
#include <string>
#include <thread>

#include "nido/launcher/child.h"

namespace {

using Living = std::map<pid_t, unsigned long long>;  // pid, start time

// Returns true if the launcher ended in order.
bool follow(Living& living) {
  std::string text;
  char buffer[4096];
  while (true) {
    const ssize_t got = read(STDIN_FILENO, buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    text.append(buffer, static_cast<std::size_t>(got));
    for (std::size_t end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
      const std::string line = text.substr(0, end);
      text.erase(0, end + 1);
      if (line == "done") return true;
      char* rest = nullptr;
      const auto pid = static_cast<pid_t>(std::strtol(line.c_str() + 1, &rest, 10));
      if (pid <= 1) continue;
      if (line.front() == '+') living[pid] = std::strtoull(rest, nullptr, 10);
      if (line.front() == '-') living.erase(pid);
    }
  }
}

// Each process leads a group of its own, in which what it started itself may outlive it. While a group has
// members, no other process gets its leader's number.
bool is_left(const Living::value_type& one) {
  const unsigned long long start = nido::start_time_of(one.first);
  return (start == 0 || start == one.second) && kill(-one.first, 0) == 0;
}

bool any_left(Living& living) {
  std::erase_if(living, [](const auto& one) { return !is_left(one); });
  return !living.empty();
}

// Waits until all are gone.
bool wait_until_gone(Living& living, std::chrono::milliseconds limit) {
  const auto until = std::chrono::steady_clock::now() + limit;
  while (any_left(living)) {
    if (std::chrono::steady_clock::now() >= until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

}  // namespace

int main() {
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGQUIT}) signal(number, SIG_IGN);
  prctl(PR_SET_NAME, "nido-janitor");
  Living living;
  if (follow(living)) return 0;
  if (!wait_until_gone(living, std::chrono::seconds(2))) {
    for (const auto& [pid, start] : living) kill(-pid, SIGKILL);
    wait_until_gone(living, std::chrono::seconds(2));
  }
  return 0;
}
