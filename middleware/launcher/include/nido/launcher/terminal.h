#pragma once

#include <string>

namespace nido {

// Colours on a terminal, plain text elsewhere (and with NO_COLOR set).
class Paint {
 public:
  explicit Paint(int fd);
  [[nodiscard]] std::string bold(const std::string& text) const { return wrap("1", text); }
  [[nodiscard]] std::string dim(const std::string& text) const { return wrap("2", text); }
  [[nodiscard]] std::string red(const std::string& text) const { return wrap("31", text); }
  [[nodiscard]] std::string green(const std::string& text) const { return wrap("32", text); }
  [[nodiscard]] std::string yellow(const std::string& text) const { return wrap("33", text); }

 private:
  [[nodiscard]] std::string wrap(const char* code, const std::string& text) const;
  bool on_;
};

// The exit code of docs/cli.md for a failure.
int exit_code_of(const struct Error& error);
// Says it on stderr; as JSON also on stdout, with exit_code, sentence and, where the sentence begins with a
// place, file and line. Returns the exit code.
int print_error(const struct Error& error, bool as_json);

}  // namespace nido
