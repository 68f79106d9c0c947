#include "keys.h"

#include <poll.h>
#include <unistd.h>

namespace nido {

Keys::Keys() {
  termios now{};
  // a process in the background would be stopped by the kernel for touching the terminal
  if (isatty(STDIN_FILENO) != 1 || tcgetpgrp(STDIN_FILENO) != getpgrp()) return;
  if (tcgetattr(STDIN_FILENO, &now) != 0) return;
  termios single = now;
  // keys come one by one and are not shown; Ctrl-C stays a signal
  single.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  single.c_cc[VMIN] = 0;
  single.c_cc[VTIME] = 0;
  if (tcsetattr(STDIN_FILENO, TCSANOW, &single) == 0) before_ = now;
}

Keys::~Keys() {
  if (before_ && tcgetpgrp(STDIN_FILENO) == getpgrp()) tcsetattr(STDIN_FILENO, TCSANOW, &*before_);
}

std::optional<char> Keys::take() {
  if (!before_ || tcgetpgrp(STDIN_FILENO) != getpgrp()) return std::nullopt;
  pollfd waiting{STDIN_FILENO, POLLIN, 0};
  char key = 0;
  if (poll(&waiting, 1, 0) != 1 || read(STDIN_FILENO, &key, 1) != 1) return std::nullopt;
  return key;
}

}  // namespace nido
