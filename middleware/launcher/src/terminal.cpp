#include "nido/launcher/terminal.h"

#include <unistd.h>

#include <cstdlib>

#include "nido/interfaces/result.h"

namespace nido {

Paint::Paint(int fd) : on_(isatty(fd) == 1 && std::getenv("NO_COLOR") == nullptr) {}

std::string Paint::wrap(const char* code, const std::string& text) const {
  return on_ ? std::string("\033[") + code + "m" + text + "\033[0m" : text;
}

int exit_code_of(const Error& error) {
  switch (error.code) {
    case ErrorCode::kInvalidArgument:
    case ErrorCode::kTaken:
    case ErrorCode::kUnsupported:
      return 2;
    case ErrorCode::kNotFound:
    case ErrorCode::kTimeout:
      return 3;
    case ErrorCode::kInterrupted:
      return 130;
    case ErrorCode::kFailed:
      return 1;
  }
  return 1;
}

}  // namespace nido
