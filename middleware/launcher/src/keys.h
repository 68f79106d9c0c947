#pragma once

#include <termios.h>

#include <optional>

namespace nido {

// Single keys from the terminal that this process was started in; none without one, or in the background.
// The terminal is as it was when this ends.
class Keys {
 public:
  Keys();
  ~Keys();
  Keys(const Keys&) = delete;
  Keys& operator=(const Keys&) = delete;

  [[nodiscard]] bool are_there() const { return before_.has_value(); }
  // The next key that was pressed; never waits.
  std::optional<char> take();

 private:
  std::optional<termios> before_;
};

}  // namespace nido
