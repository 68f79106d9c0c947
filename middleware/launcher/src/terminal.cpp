#include "nido/launcher/terminal.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <regex>

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
    static const std::regex kPlace("([^:\n]+):([0-9]{1,8}): [^]*");
    if (std::smatch parts; std::regex_match(error.message, parts, kPlace)) {
      object["file"] = parts[1].str();
      object["line"] = std::stoi(parts[2].str());
    }
    fmt::print("{}\n", object.dump());
  }
  return code;
}

}  // namespace nido
