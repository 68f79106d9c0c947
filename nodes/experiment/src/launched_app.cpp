#include "nido/experiment/launched_app.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "nido/launcher/paths.h"

namespace nido {

Result<LaunchedApp> LaunchedApp::start(const std::string& app, const std::vector<std::string>& arguments,
                                       const std::string& log) {
  const auto places = find_places();
  if (!places) return places.error();
  std::vector<std::string> words = {(places->programs / "nido").string(), "launch", app};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  const int output = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (output < 0)
    return Error{ErrorCode::kFailed, fmt::format("{}: cannot be written: {}", log, std::strerror(errno))};
  const pid_t self = getpid();
  const pid_t child = fork();
  if (child == 0) {
    // an experiment that is killed takes its app with it
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != self) _exit(127);
    dup2(output, STDOUT_FILENO);
    dup2(output, STDERR_FILENO);
    execv(argv.front(), argv.data());
    _exit(127);
  }
  close(output);
  if (child < 0)
    return Error{ErrorCode::kFailed, fmt::format("no process for {}: {}", words[0], std::strerror(errno))};
  return LaunchedApp(child, app, log);
}

LaunchedApp::LaunchedApp(LaunchedApp&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      app_(std::move(other.app_)),
      log_(std::move(other.log_)),
      ended_(std::move(other.ended_)) {}

LaunchedApp::~LaunchedApp() {
  if (pid_ < 0) return;
  kill(pid_, SIGINT);
  static_cast<void>(wait());
}

std::optional<Status> LaunchedApp::reap(int flags) {
  if (ended_) return ended_;
  int state = 0;
  pid_t reaped = 0;
  do {
    reaped = waitpid(pid_, &state, flags);
  } while (reaped < 0 && errno == EINTR);
  if (reaped == 0) return std::nullopt;
  if (reaped < 0) {
    ended_ = Error{ErrorCode::kFailed, fmt::format("lost app {}: {}", app_, std::strerror(errno))};
  } else if (const int code = WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state); code == 0) {
    ended_ = Status();
  } else if (code == 130) {
    ended_ = Error{ErrorCode::kInterrupted, "interrupted"};
  } else {
    ended_ = Error{ErrorCode::kFailed,
                   fmt::format("app {} ended with exit code {}; its words are in {}", app_, code, log_)};
  }
  pid_ = -1;
  return ended_;
}

std::optional<Status> LaunchedApp::poll() { return reap(WNOHANG); }

Status LaunchedApp::wait() {
  while (true) {
    if (auto ended = reap(0)) return *ended;
  }
}

Status run_app(const std::string& app, const std::vector<std::string>& arguments, const std::string& log,
               const InterruptFlag& interrupt) {
  auto running = LaunchedApp::start(app, arguments, log);
  if (!running) return running.error();
  while (!interrupt.raised()) {
    if (auto ended = running->poll()) return *ended;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return Error{ErrorCode::kInterrupted, "interrupted"};  // and the app with us
}

}  // namespace nido
