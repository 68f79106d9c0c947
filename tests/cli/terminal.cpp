#include "terminal.h"

#include <fcntl.h>
#include <pty.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "temp_folder.h"
#include "tool.h"

namespace nido::test {

Terminal::Terminal(const std::string& path, const std::vector<std::string>& arguments,
                   const std::map<std::string, std::string>& environment) {
  std::vector<std::string> words = {path};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  winsize size{};
  size.ws_row = 50;
  size.ws_col = 200;
  pid_ = forkpty(&terminal_, nullptr, nullptr, &size);
  if (pid_ == 0) {
    for (const auto& [key, value] : environment) setenv(key.c_str(), value.c_str(), 1);
    execv(path.c_str(), argv.data());
    _exit(127);
  }
  fcntl(terminal_, F_SETFL, fcntl(terminal_, F_GETFL) | O_NONBLOCK);
  fcntl(terminal_, F_SETFD, FD_CLOEXEC);
}

Terminal::~Terminal() {
  for (const pid_t pid : living()) kill(pid, SIGKILL);
  if (!has_ended_) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  close(terminal_);
}

void Terminal::type(const std::string& keys) const {
  [[maybe_unused]] const ssize_t written = write(terminal_, keys.data(), keys.size());
}

void Terminal::read_some() {
  std::array<char, 4096> part{};
  for (ssize_t size = 0; (size = read(terminal_, part.data(), part.size())) > 0;) {
    text_.append(part.data(), static_cast<std::size_t>(size));
  }
}

bool Terminal::wait_for(const std::string& text, std::chrono::seconds limit) {
  return becomes_true(
      [&] {
        read_some();
        const auto at = text_.find(text, matched_);
        if (at == std::string::npos) return false;
        matched_ = at + text.size();
        return true;
      },
      limit);
}

int Terminal::wait(std::chrono::seconds limit) {
  int status = 0;
  has_ended_ = becomes_true(
      [&] {
        read_some();  // who writes to a full terminal does not end
        return waitpid(pid_, &status, WNOHANG) == pid_;
      },
      limit);
  read_some();
  if (!has_ended_) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

bool Terminal::is_by_lines() const {
  termios mode{};
  tcgetattr(terminal_, &mode);
  return (mode.c_lflag & ICANON) != 0 && (mode.c_lflag & ECHO) != 0;
}

std::vector<pid_t> Terminal::living() const {
  std::vector<pid_t> found;
  for (const pid_t pid : processes_with("")) {
    // "PID (NAME) STATE PARENT GROUP SESSION ..."
    const std::string stat = read_text("/proc/" + std::to_string(pid) + "/stat");
    const auto name_end = stat.rfind(')');
    if (name_end == std::string::npos) continue;
    std::istringstream words(stat.substr(name_end + 1));
    std::string state;
    pid_t parent = 0;
    pid_t group = 0;
    pid_t session = 0;
    words >> state >> parent >> group >> session;
    if (session == pid_ && state != "Z") found.push_back(pid);
  }
  return found;
}

}  // namespace nido::test
