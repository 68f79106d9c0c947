#pragma once

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

namespace nido::test {

// What @mcap/core and its kind make of a file (read_mcap.mjs); or why that cannot be asked here.
struct ForeignView {
  nlohmann::json contents;
  std::string absent;     // node or the library is not installed: docs/recording.md
  std::string complaint;  // what the library did not accept
};

inline ForeignView view_with_mcap_core(const std::string& file) {
  const std::string command = std::string("node ") + READ_MCAP + " " + NODE_MODULES + " " + file + " 2>&1";
  std::FILE* pipe = popen(command.c_str(), "r");
  std::string text;
  std::array<char, 4096> buffer{};
  while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe))
    text.append(buffer.data(), count);
  const int status = pclose(pipe);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  ForeignView view;
  if (code == 77 || code == 127) {
    view.absent =
        "@mcap/core is not installed in " + std::string(NODE_MODULES) + " (docs/recording.md says how)";
  } else if (code != 0) {
    view.complaint = text;
  } else {
    view.contents = nlohmann::json::parse(text, nullptr, false);
  }
  return view;
}

}  // namespace nido::test
