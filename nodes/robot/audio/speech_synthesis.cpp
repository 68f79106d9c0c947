#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "audio/clip.h"

extern char** environ;

namespace nido {
namespace {

constexpr int kTimeout_ms = 10'000;
constexpr double kPeak_dB = -3;

// a file that goes away with this object
class TemporaryFile {
 public:
  TemporaryFile() {
    const int file = mkstemps(path_.data(), 4);
    if (file >= 0) close(file);
    is_open_ = file >= 0;
  }
  ~TemporaryFile() {
    if (is_open_) unlink(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  [[nodiscard]] bool is_open() const { return is_open_; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_ = (std::filesystem::temp_directory_path() / "nido-speech-XXXXXX.wav").string();
  bool is_open_ = false;
};

// Starts a program without a shell, with the default handling of signals and nothing on its output.
Result<pid_t> start(const std::string& program, const std::vector<std::string>& arguments) {
  std::vector<char*> argv = {const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  pid_t child = 0;
  const int failure = posix_spawnp(&child, program.c_str(), &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (failure == ENOENT) {
    return Error{
        ErrorCode::kNotFound,
        fmt::format("the program {0} is not installed: install the package {0}, or choose a sound file "
                    "(audio source wav)",
                    program)};
  }
  if (failure != 0)
    return Error{ErrorCode::kFailed, fmt::format("cannot start {}: {}", program, strerror(failure))};
  return child;
}

// Waits for the end of a child; ends it when the time is over.
Status wait_for(pid_t child, const std::string& program) {
  const int handle = static_cast<int>(syscall(SYS_pidfd_open, child, 0));
  pollfd ended{handle, POLLIN, 0};
  int ready = 0;
  do {
    ready = poll(&ended, 1, kTimeout_ms);
  } while (ready < 0 && errno == EINTR);
  if (handle >= 0) close(handle);
  if (ready == 0) kill(child, SIGKILL);
  int outcome = 0;
  waitpid(child, &outcome, 0);
  if (ready == 0) {
    return Error{ErrorCode::kTimeout, fmt::format("{} did not end within {} s", program, kTimeout_ms / 1000)};
  }
  if (!WIFEXITED(outcome) || WEXITSTATUS(outcome) != 0) {
    return Error{ErrorCode::kFailed, fmt::format("{} failed (exit code {})", program,
                                                 WIFEXITED(outcome) ? WEXITSTATUS(outcome) : -1)};
  }
  return {};
}

}  // namespace

Result<Clip> synthesise_speech(const std::string& text, const std::string& voice) {
  if (text.empty()) return Error{ErrorCode::kInvalidArgument, "there is no text to say"};
  const TemporaryFile file;
  if (!file.is_open()) return Error{ErrorCode::kFailed, "cannot make a temporary file for the spoken text"};
  const std::string program = "espeak-ng";
  const Result<pid_t> child = start(program, {"-v", voice, "-w", file.path(), "--", text});
  if (!child) return child.error();
  if (const Status ended = wait_for(*child, program); !ended) {
    return Error{ended.error().code, fmt::format("{}; voice '{}'", ended.error().message, voice)};
  }
  Result<Clip> clip = read_sound_file(file.path());
  if (!clip || clip->samples.empty()) {
    return Error{
        ErrorCode::kFailed,
        fmt::format("{} said nothing: is '{}' one of its voices (espeak-ng --voices)?", program, voice)};
  }
  return normalised(std::move(*clip), kPeak_dB);
}

}  // namespace nido
