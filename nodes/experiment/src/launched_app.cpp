#include "nido/experiment/launched_app.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "nido/launcher/paths.h"

namespace nido {

Status run_app(const std::string& app, const std::vector<std::string>& arguments, const std::string& log) {
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
  const pid_t child = fork();
  if (child == 0) {
    dup2(output, STDOUT_FILENO);
    dup2(output, STDERR_FILENO);
    execv(argv.front(), argv.data());
    _exit(127);
  }
  close(output);
  if (child < 0)
    return Error{ErrorCode::kFailed, fmt::format("no process for {}: {}", words[0], std::strerror(errno))};
  int state = 0;
  while (waitpid(child, &state, 0) < 0) {
    if (errno != EINTR)
      return Error{ErrorCode::kFailed, fmt::format("lost {}: {}", words[0], std::strerror(errno))};
  }
  const int code = WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state);
  if (code == 0) return {};
  if (code == 130) return Error{ErrorCode::kInterrupted, "interrupted"};
  return Error{ErrorCode::kFailed,
               fmt::format("app {} ended with exit code {}; its words are in {}", app, code, log)};
}

}  // namespace nido
