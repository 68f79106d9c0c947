#include "nido/launcher/child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

extern char** environ;

namespace nido {
namespace {

// Everything of our own (sockets, shared memory) must not leak into the program.
void close_all_on_exec() {
#ifdef SYS_close_range
  constexpr unsigned int kCloseOnExec = 1U << 2U;
  if (syscall(SYS_close_range, 3U, ~0U, kCloseOnExec) == 0) return;
#endif
  for (int fd = 3; fd < 1024; ++fd) fcntl(fd, F_SETFD, FD_CLOEXEC);
}

// Between fork and exec: only calls that are safe in a child of a process with threads.
[[noreturn]] void become(const char* program, char* const* argv, char* const* envp, int output, int null,
                         int failure, pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(127);  // the parent died before the line above
  for (int number = 1; number < NSIG; ++number) signal(number, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  dup2(null, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  close_all_on_exec();
  execve(program, argv, envp);
  const int error = errno;
  [[maybe_unused]] const ssize_t written = write(failure, &error, sizeof error);
  _exit(127);
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> result;
  for (auto& text : texts) result.push_back(text.data());
  result.push_back(nullptr);
  return result;
}

}  // namespace

std::string describe(const ExitState& state) {
  if (state.by_signal) return fmt::format("was killed by signal {} ({})", state.code, strsignal(state.code));
  return fmt::format("ended with exit code {}", state.code);
}

Result<Child> spawn(const ChildCommand& command) {
  if (access(command.program.c_str(), F_OK) != 0) {
    return Error{ErrorCode::kNotFound, fmt::format("there is no program {}: is it built?", command.program)};
  }
  std::vector<std::string> arguments{command.program};
  arguments.insert(arguments.end(), command.arguments.begin(), command.arguments.end());
  std::vector<std::string> environment;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    if (!command.environment.contains(text.substr(0, text.find('=')))) environment.push_back(text);
  }
  for (const auto& [key, value] : command.environment) environment.push_back(key + "=" + value);
  const auto argv = pointers(arguments);
  const auto envp = pointers(environment);

  int output[2];
  int failure[2];
  if (pipe2(output, O_CLOEXEC) != 0)
    return Error{ErrorCode::kFailed, fmt::format("no pipe: {}", std::strerror(errno))};
  if (pipe2(failure, O_CLOEXEC) != 0) {
    close(output[0]);
    close(output[1]);
    return Error{ErrorCode::kFailed, fmt::format("no pipe: {}", std::strerror(errno))};
  }
  const int null = open("/dev/null", O_RDONLY | O_CLOEXEC);
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) {
    become(command.program.c_str(), argv.data(), envp.data(), output[1], null, failure[1], parent);
  }
  const int fork_error = errno;
  if (null >= 0) close(null);
  close(output[1]);
  close(failure[1]);
  if (pid < 0) {
    close(output[0]);
    close(failure[0]);
    return Error{ErrorCode::kFailed,
                 fmt::format("no process for {}: {}", command.program, std::strerror(fork_error))};
  }
  int exec_error = 0;
  ssize_t got = 0;
  while ((got = read(failure[0], &exec_error, sizeof exec_error)) < 0 && errno == EINTR) {
  }
  close(failure[0]);
  if (got > 0) {
    close(output[0]);
    int ignored = 0;
    while (waitpid(pid, &ignored, 0) < 0 && errno == EINTR) {
    }
    return Error{exec_error == ENOENT || exec_error == EACCES ? ErrorCode::kNotFound : ErrorCode::kFailed,
                 fmt::format("{} cannot be started: {}", command.program, std::strerror(exec_error))};
  }
  Child child;
  child.pid = pid;
  child.output_fd = output[0];
  fcntl(child.output_fd, F_SETFL, O_NONBLOCK);
#ifdef SYS_pidfd_open
  child.pidfd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
#endif
  return child;
}

unsigned long long start_time_of(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/stat", pid));
  std::string line;
  if (!std::getline(file, line)) return 0;
  // the name in brackets may hold anything: count fields from the last bracket; the start time is field 22
  const std::size_t bracket = line.rfind(')');
  if (bracket == std::string::npos) return 0;
  std::istringstream rest(line.substr(bracket + 1));
  std::string state;
  rest >> state;
  if (state == "Z" || state == "X") return 0;
  std::string skipped;
  for (int field = 4; field < 22; ++field) rest >> skipped;
  unsigned long long start = 0;
  rest >> start;
  return start;
}

}  // namespace nido
