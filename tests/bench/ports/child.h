#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace nido::bench {

// A second process of a benchmark: this program again, with other arguments. It ends when its standard input
// does, and is killed when this object goes or this process dies.
class Child {
 public:
  explicit Child(const std::vector<std::string>& arguments);
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  void say(const std::string& line) const;
  // Its next line; nothing if none comes in time or it has ended.
  std::optional<std::string> hear(double timeout_s);
  void kill_now();

 private:
  pid_t pid_ = -1;
  int in_ = -1;
  int out_ = -1;
  std::string pending_;
};

// In the child: dies with its parent from here on.
void live_no_longer_than_parent();
// In the child: a line to the parent.
void tell_parent(const std::string& line);
// In the child: the parent's next line; nothing at the end.
std::optional<std::string> hear_parent();

// In the child, for loops that wait for something else than the parent: ends this process when the parent
// closes its end.
void end_with_parent();

// Nanoseconds of the clock that all processes of a machine share.
long long now_ns();

}  // namespace nido::bench
