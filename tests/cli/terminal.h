#pragma once

#include <sys/types.h>

#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace nido::test {

// A program in a terminal of its own, as a person has it before them: what is typed goes through the
// terminal, so Ctrl-C is a signal to all processes that run there. Killed with the object if it still lives.
class Terminal {
 public:
  Terminal(const std::string& path, const std::vector<std::string>& arguments,
           const std::map<std::string, std::string>& environment = {});
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  void type(const std::string& keys) const;
  // Waits until what was written after the last match holds `text`.
  bool wait_for(const std::string& text, std::chrono::seconds limit = std::chrono::seconds(30));
  // Waits for the program's end: its exit code, or 128 + signal; -1 when it does not end.
  int wait(std::chrono::seconds limit = std::chrono::seconds(30));
  // The terminal gives what is typed line by line, and shows it, as it does when nobody has changed that.
  [[nodiscard]] bool is_by_lines() const;
  // Everything that it wrote.
  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] pid_t pid() const { return pid_; }
  // Processes that were started there and still live.
  [[nodiscard]] std::vector<pid_t> living() const;

 private:
  void read_some();
  int terminal_ = -1;
  pid_t pid_ = -1;
  bool has_ended_ = false;
  std::string text_;
  std::size_t matched_ = 0;
};

}  // namespace nido::test
