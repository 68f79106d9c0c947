#pragma once

#include <sys/types.h>

#include <chrono>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace nido::test {

// What a program wrote and how it ended. `code`: exit code, or 128 + signal.
struct Ended {
  int code = -1;
  std::string out;
  std::string err;
};

// A started program, whose output goes to files; killed with the object if it still lives.
class Program {
 public:
  Program(const std::string& path, const std::vector<std::string>& arguments,
          const std::map<std::string, std::string>& environment = {});
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  // Waits until its output holds `text`.
  bool wait_for(const std::string& text, std::chrono::seconds limit = std::chrono::seconds(30));
  void signal(int number) const;
  // Waits for its end; kills it when that does not come within the limit.
  Ended wait(std::chrono::seconds limit = std::chrono::seconds(60));
  [[nodiscard]] std::string out() const;
  [[nodiscard]] std::string err() const;
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  std::string out_file_;
  std::string err_file_;
  pid_t pid_ = -1;
};

// `nido` with these words, in a domain of the tests' own.
Ended nido_tool(const std::vector<std::string>& words);
int test_domain();

// Waits for something of which no event tells.
bool becomes_true(const std::function<bool()>& condition,
                  std::chrono::seconds limit = std::chrono::seconds(20));
// pids of the living processes whose command line holds `text`.
std::vector<pid_t> processes_with(const std::string& text);
// Names in /dev/shm.
std::vector<std::string> shared_memory_files();

}  // namespace nido::test
