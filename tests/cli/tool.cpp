#include "tool.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "temp_folder.h"

namespace nido::test {
namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

Program::Program(const std::string& path, const std::vector<std::string>& arguments,
                 const std::map<std::string, std::string>& environment) {
  std::string name = (fs::temp_directory_path() / "nido-tool-XXXXXX").string();
  close(mkstemp(name.data()));
  out_file_ = name;
  err_file_ = name + ".err";
  std::vector<std::string> words = {path};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_ = fork();
  if (pid_ == 0) {
    dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
    dup2(open(out_file_.c_str(), O_WRONLY | O_TRUNC), STDOUT_FILENO);
    dup2(open(err_file_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
    for (const auto& [key, value] : environment) setenv(key.c_str(), value.c_str(), 1);
    execv(path.c_str(), argv.data());
    _exit(127);
  }
}

Program::~Program() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  std::error_code ignored;
  fs::remove(out_file_, ignored);
  fs::remove(err_file_, ignored);
}

std::string Program::out() const { return read_text(out_file_); }
std::string Program::err() const { return read_text(err_file_); }
void Program::signal(int number) const { kill(pid_, number); }

bool Program::wait_for(const std::string& text, std::chrono::seconds limit) {
  return becomes_true([&] { return out().find(text) != std::string::npos; }, limit);
}

Ended Program::wait(std::chrono::seconds limit) {
  Ended ended;
  int status = 0;
  if (!becomes_true([&] { return waitpid(pid_, &status, WNOHANG) == pid_; }, limit)) {
    kill(pid_, SIGKILL);
    waitpid(pid_, &status, 0);
    ended.err = "(did not end and was killed) ";
  }
  pid_ = -1;
  ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  ended.out = out();
  ended.err += err();
  return ended;
}

int test_domain() {
  // another one for each test process: tests of several build trees do not meet
  return 60 + static_cast<int>(getpid() % 40);
}

Ended nido_tool(const std::vector<std::string>& words) {
  Program program(NIDO, words, {{"ROS_DOMAIN_ID", std::to_string(test_domain())}});
  return program.wait();
}

bool becomes_true(const std::function<bool()>& condition, std::chrono::seconds limit) {
  const auto until = steady_clock::now() + limit;
  while (!condition()) {
    if (steady_clock::now() > until) return false;
    std::this_thread::sleep_for(milliseconds(10));
  }
  return true;
}

std::vector<pid_t> processes_with(const std::string& text) {
  std::vector<pid_t> pids;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    if (!std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isdigit(c) != 0; }))
      continue;
    if (std::stoi(name) == getpid()) continue;
    if (read_text(entry.path() / "cmdline").find(text) != std::string::npos) pids.push_back(std::stoi(name));
  }
  return pids;
}

std::vector<std::string> shared_memory_files() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator("/dev/shm"))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace nido::test
