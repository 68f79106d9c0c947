#include "nido/launcher/supervisor.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <deque>

namespace nido {
using SteadyClock = std::chrono::steady_clock;

namespace {
constexpr std::size_t kLinesKept = 12;
constexpr std::size_t kLongestLine = 4000;
}  // namespace

struct Supervisor::Entry {
  SupervisedProcess process;
  Child child;
  bool running = false;
  int log_fd = -1;
  std::string partial;  // output after the last line end
  std::deque<std::string> lines;
  std::deque<SteadyClock::time_point> restart_times;  // in the policy's window
  int restarts = 0;
  std::optional<SteadyClock::time_point> restart_due;
  std::optional<SteadyClock::time_point> kill_due;  // SIGTERM was sent; SIGKILL then
};

// Tells nido-janitor which processes live; when this process dies, the pipe closes and the janitor acts.
class Supervisor::JanitorLink {
 public:
  static Result<std::unique_ptr<JanitorLink>> start(const std::string& program) {
    if (access(program.c_str(), X_OK) != 0) {
      return Error{ErrorCode::kNotFound, fmt::format("there is no program {}: is it built?", program)};
    }
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
      return Error{ErrorCode::kFailed, fmt::format("no pipe: {}", std::strerror(errno))};
    std::string path = program;
    char* argv[] = {path.data(), nullptr};
    const pid_t pid = fork();
    if (pid == 0) {
      setsid();
      sigset_t none;
      sigemptyset(&none);
      sigprocmask(SIG_SETMASK, &none, nullptr);
      dup2(ends[0], STDIN_FILENO);
      const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
      dup2(null, STDOUT_FILENO);
      dup2(null, STDERR_FILENO);
      for (int fd = 3; fd < 1024; ++fd) close(fd);
      execv(path.c_str(), argv);
      _exit(127);
    }
    const int error = errno;
    close(ends[0]);
    if (pid < 0) {
      close(ends[1]);
      return Error{ErrorCode::kFailed, fmt::format("no process for {}: {}", program, std::strerror(error))};
    }
    auto link = std::unique_ptr<JanitorLink>(new JanitorLink);
    link->pid_ = pid;
    link->fd_ = ends[1];
    return link;
  }
  ~JanitorLink() {
    say("done\n");
    close(fd_);
    int ignored = 0;
    while (waitpid(pid_, &ignored, 0) < 0 && errno == EINTR) {
    }
  }
  JanitorLink(const JanitorLink&) = delete;
  JanitorLink& operator=(const JanitorLink&) = delete;
  void started(pid_t pid) { say(fmt::format("+{} {}\n", pid, start_time_of(pid))); }
  void ended(pid_t pid) { say(fmt::format("-{}\n", pid)); }

 private:
  JanitorLink() = default;
  void say(const std::string& text) const {
    // SIGPIPE is ignored in create(); a janitor that was killed is no reason to end the run
    [[maybe_unused]] const ssize_t written = write(fd_, text.data(), text.size());
  }
  pid_t pid_ = -1;
  int fd_ = -1;
};

Supervisor::Supervisor() = default;

Result<std::unique_ptr<Supervisor>> Supervisor::create(const std::string& janitor_program) {
  std::unique_ptr<Supervisor> supervisor(new Supervisor);
  signal(SIGPIPE, SIG_IGN);
  if (!janitor_program.empty()) {
    auto link = JanitorLink::start(janitor_program);
    if (!link) return link.error();
    supervisor->janitor_ = std::move(*link);
  }
  return supervisor;
}

Supervisor::~Supervisor() {
  kill_all();
  while (!all_gone()) poll(std::chrono::milliseconds(100));
  for (auto& entry : entries_) {
    if (entry->log_fd >= 0) close(entry->log_fd);
  }
}

Supervisor::Entry* Supervisor::find(const std::string& name) const {
  for (const auto& entry : entries_) {
    if (entry->process.name == name) return entry.get();
  }
  return nullptr;
}

Status Supervisor::start(SupervisedProcess process) {
  if (find(process.name) != nullptr) {
    return Error{ErrorCode::kTaken, fmt::format("there is a process '{}' already", process.name)};
  }
  auto entry = std::make_unique<Entry>();
  entry->process = std::move(process);
  if (!entry->process.log_file.empty()) {
    entry->log_fd = open(entry->process.log_file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
    if (entry->log_fd < 0) {
      return Error{ErrorCode::kFailed,
                   fmt::format("{} cannot be written: {}", entry->process.log_file, std::strerror(errno))};
    }
  }
  if (auto status = launch(*entry); !status) {
    if (entry->log_fd >= 0) close(entry->log_fd);
    return status;
  }
  entries_.push_back(std::move(entry));
  return {};
}

Status Supervisor::launch(Entry& entry) {
  // a node tells it to who asks (nido node info)
  ChildCommand command = entry.process.command;
  command.environment["NIDO_RESTARTS"] = std::to_string(entry.restarts);
  auto child = spawn(command);
  if (!child)
    return Error{child.error().code,
                 fmt::format("process '{}': {}", entry.process.name, child.error().message)};
  entry.child = *child;
  entry.running = true;
  entry.partial.clear();
  entry.kill_due.reset();
  if (janitor_) janitor_->started(entry.child.pid);
  return {};
}

void Supervisor::keep_line(Entry& entry, const std::string& line, std::vector<SupervisorEvent>& events) {
  entry.lines.push_back(line);
  if (entry.lines.size() > kLinesKept) entry.lines.pop_front();
  SupervisorEvent event;
  event.kind = SupervisorEvent::Kind::kOutput;
  event.name = entry.process.name;
  event.text = line;
  events.push_back(std::move(event));
}

void Supervisor::read_output(Entry& entry, std::vector<SupervisorEvent>& events) {
  if (entry.child.output_fd < 0) return;
  char buffer[16384];
  // bounded: a process that writes without end must not keep us here
  for (int round = 0; round < 16; ++round) {
    const ssize_t got = read(entry.child.output_fd, buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return;  // nothing more for now
    if (got == 0) {
      close(entry.child.output_fd);
      entry.child.output_fd = -1;
      return;
    }
    if (entry.log_fd >= 0) {
      [[maybe_unused]] const ssize_t written = write(entry.log_fd, buffer, static_cast<std::size_t>(got));
    }
    entry.partial.append(buffer, static_cast<std::size_t>(got));
    std::size_t from = 0;
    for (std::size_t end = entry.partial.find('\n'); end != std::string::npos;
         end = entry.partial.find('\n', from)) {
      keep_line(entry, entry.partial.substr(from, end - from), events);
      from = end + 1;
    }
    entry.partial.erase(0, from);
    if (entry.partial.size() > kLongestLine) {
      keep_line(entry, entry.partial, events);
      entry.partial.clear();
    }
  }
}

std::optional<ExitState> Supervisor::reap(Entry& entry, std::vector<SupervisorEvent>& events) {
  siginfo_t info{};
  // first look without collecting: while the pid is ours, its group cannot be somebody else's
  if (waitid(P_PID, static_cast<id_t>(entry.child.pid), &info, WEXITED | WNOHANG | WNOWAIT) != 0 ||
      info.si_pid == 0) {
    return std::nullopt;
  }
  kill(-entry.child.pid, SIGKILL);  // what it started itself
  int status = 0;
  while (waitpid(entry.child.pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (janitor_) janitor_->ended(entry.child.pid);
  read_output(entry, events);
  if (!entry.partial.empty()) keep_line(entry, std::exchange(entry.partial, ""), events);
  if (entry.child.output_fd >= 0) close(entry.child.output_fd);
  if (entry.child.pidfd >= 0) close(entry.child.pidfd);
  entry.child = {};
  entry.running = false;
  entry.kill_due.reset();
  ExitState state;
  state.by_signal = WIFSIGNALED(status);
  state.code = state.by_signal ? WTERMSIG(status) : WEXITSTATUS(status);
  return state;
}

void Supervisor::after_end(Entry& entry, ExitState state, std::vector<SupervisorEvent>& events) {
  SupervisorEvent event;
  event.name = entry.process.name;
  event.exit = state;
  event.last_lines.assign(entry.lines.begin(), entry.lines.end());
  event.kind = SupervisorEvent::Kind::kEnded;
  event.text = fmt::format("process '{}' {}", entry.process.name, describe(state));

  const RestartPolicy& policy = entry.process.restart;
  if (!stopping_ && !killing_ && policy.on_failure && !state.clean()) {
    const auto now = SteadyClock::now();
    while (!entry.restart_times.empty() &&
           std::chrono::duration<double>(now - entry.restart_times.front()).count() > policy.window_s) {
      entry.restart_times.pop_front();
    }
    const auto recent = static_cast<int>(entry.restart_times.size());
    if (recent >= policy.max_restarts) {
      event.kind = SupervisorEvent::Kind::kGivenUp;
      event.text +=
          fmt::format("; it was restarted {} times in {} s and is given up", recent, policy.window_s);
    } else {
      const double wait_s = std::min(policy.backoff_max_s, policy.backoff_s * std::pow(2.0, recent));
      entry.restart_due =
          now + std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(wait_s));
      entry.restart_times.push_back(now);
      event.kind = SupervisorEvent::Kind::kRestarting;
      event.text += fmt::format("; it is started again in {:.1f} s (restart {} of at most {})", wait_s,
                                recent + 1, policy.max_restarts);
    }
  }
  events.push_back(std::move(event));
}

std::vector<SupervisorEvent> Supervisor::poll(std::chrono::milliseconds timeout, int wake_fd) {
  std::vector<SupervisorEvent> events;
  auto now = SteadyClock::now();
  auto until = now + timeout;
  std::vector<pollfd> fds;
  bool all_have_pidfds = true;
  for (const auto& entry : entries_) {
    if (entry->running) {
      fds.push_back({entry->child.output_fd, POLLIN, 0});
      fds.push_back({entry->child.pidfd, POLLIN, 0});
      all_have_pidfds = all_have_pidfds && entry->child.pidfd >= 0;
    }
    if (entry->restart_due && !stopping_) until = std::min(until, *entry->restart_due);
    if (entry->kill_due) until = std::min(until, *entry->kill_due);
  }
  if (stopping_) {
    const auto soonest = now + std::chrono::milliseconds(1);
    until = std::min({until, std::max(stop_deadline_, soonest), std::max(next_stop_, soonest)});
  }
  // without pidfds the end of a process is seen by looking
  if (!all_have_pidfds) until = std::min(until, now + std::chrono::milliseconds(20));
  fds.push_back({wake_fd, POLLIN, 0});
  const auto wait = std::chrono::ceil<std::chrono::milliseconds>(until - now).count();
  ::poll(fds.data(), fds.size(), static_cast<int>(std::max<decltype(wait)>(0, wait)));

  for (auto& entry : entries_) {
    if (!entry->running) continue;
    read_output(*entry, events);
    if (const auto state = reap(*entry, events)) after_end(*entry, *state, events);
  }
  now = SteadyClock::now();
  for (auto& entry : entries_) {
    if (!entry->restart_due || stopping_ || killing_ || now < *entry->restart_due) continue;
    entry->restart_due.reset();
    SupervisorEvent event;
    event.name = entry->process.name;
    ++entry->restarts;
    if (auto status = launch(*entry); status) {
      event.kind = SupervisorEvent::Kind::kRestarted;
      event.text = fmt::format("process '{}' was started again", entry->process.name);
    } else {
      event.kind = SupervisorEvent::Kind::kGivenUp;
      event.text = status.error().message;
      event.exit.code = 127;
    }
    events.push_back(std::move(event));
  }
  if (stopping_) go_on_stopping();
  return events;
}

void Supervisor::begin_stop(std::chrono::milliseconds grace, std::chrono::milliseconds whole_grace,
                            std::chrono::milliseconds stagger) {
  if (stopping_) return;
  stopping_ = true;
  grace_ = grace;
  stagger_ = stagger;
  stop_deadline_ = SteadyClock::now() + whole_grace;
  for (auto& entry : entries_) entry->restart_due.reset();
  go_on_stopping();
}

void Supervisor::go_on_stopping() {
  const auto now = SteadyClock::now();
  if (now >= stop_deadline_ && !killing_) kill_all();
  // last started first; the one before it is asked when it has gone, or after a while: on a busy machine
  // they would not all have their grace otherwise
  for (auto it = entries_.rbegin(); it != entries_.rend(); ++it) {
    Entry& entry = **it;
    if (!entry.running) continue;
    if (!entry.kill_due) {
      kill(entry.child.pid, SIGTERM);
      entry.kill_due = now + grace_;
      next_stop_ = now + stagger_;
    } else if (now >= *entry.kill_due) {
      killed_.push_back(entry.process.name);
      kill(-entry.child.pid, SIGKILL);
      entry.kill_due = now + std::chrono::hours(1);
    }
    if (now < next_stop_) return;
  }
}

void Supervisor::kill_all() {
  killing_ = true;
  for (auto& entry : entries_) {
    entry->restart_due.reset();
    if (!entry->running) continue;
    if (stopping_ && std::find(killed_.begin(), killed_.end(), entry->process.name) == killed_.end()) {
      killed_.push_back(entry->process.name);
    }
    kill(-entry->child.pid, SIGKILL);
    kill(entry->child.pid, SIGKILL);
  }
}

bool Supervisor::all_gone() const {
  return std::none_of(entries_.begin(), entries_.end(),
                      [](const auto& entry) { return entry->running || entry->restart_due.has_value(); });
}

bool Supervisor::running(const std::string& name) const {
  const Entry* entry = find(name);
  return entry != nullptr && entry->running;
}

pid_t Supervisor::pid_of(const std::string& name) const {
  const Entry* entry = find(name);
  return entry == nullptr ? -1 : entry->child.pid;
}

int Supervisor::restarts_of(const std::string& name) const {
  const Entry* entry = find(name);
  return entry == nullptr ? 0 : entry->restarts;
}

const std::vector<std::string>& Supervisor::killed() const { return killed_; }

std::vector<std::string> Supervisor::last_lines(const std::string& name) const {
  const Entry* entry = find(name);
  if (entry == nullptr) return {};
  return {entry->lines.begin(), entry->lines.end()};
}

}  // namespace nido
