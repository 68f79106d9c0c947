#include "nido/launcher/terminal.h"

#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string_view>

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

int print_error(const Error& error, bool as_json) {
  const int code = exit_code_of(error);
  fmt::print(stderr, "error: {}\n", error.message);
  if (as_json) {
    nlohmann::json object{{"exit_code", code}, {"sentence", error.message}};
    // FILE:LINE: SENTENCE
    const std::string_view text = error.message;
    const std::size_t file_end = text.find_first_of(":\n");
    const std::size_t line_end = text.find(": ", file_end == text.npos ? file_end : file_end + 1);
    int line = 0;
    if (file_end > 0 && line_end != text.npos && text[file_end] == ':') {
      const auto read = std::from_chars(text.data() + file_end + 1, text.data() + line_end, line);
      if (read.ec == std::errc() && read.ptr == text.data() + line_end && line >= 0) {
        object["file"] = text.substr(0, file_end);
        object["line"] = line;
      }
    }
    fmt::print("{}\n", object.dump());
  }
  return code;
}

}  // namespace nido
