#pragma once

#include <sys/types.h>

#include <map>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// A program to start.
struct ChildCommand {
  std::string program;                             // path of an executable
  std::vector<std::string> arguments;              // without the program's name
  std::map<std::string, std::string> environment;  // added to this process's own
};

// A started program: in a process group of its own, stdin empty, stdout and stderr in one pipe.
struct Child {
  pid_t pid = -1;
  int pidfd = -1;      // readable when it has ended; -1 on kernels without pidfd
  int output_fd = -1;  // non-blocking read end of the pipe
};

// How a program ended.
struct ExitState {
  bool by_signal = false;
  int code = 0;  // exit code, or the signal's number
  [[nodiscard]] bool clean() const { return !by_signal && code == 0; }
};

// "ended with exit code 3", "was killed by signal 9 (Killed)".
std::string describe(const ExitState& state);

// Starts a program. The kernel sends it SIGTERM when the calling THREAD ends (PR_SET_PDEATHSIG), so call this
// from one that lives as long as the run. kNotFound if there is no such program, kFailed otherwise.
Result<Child> spawn(const ChildCommand& command);

// Kernel's start time of a process, which with the pid names it for ever; 0 if there is no such process.
unsigned long long start_time_of(pid_t pid);

}  // namespace nido
