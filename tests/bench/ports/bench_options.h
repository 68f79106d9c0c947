#pragma once

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "nido/interfaces/result.h"

namespace nido::bench {

// What every benchmark of ports takes.
struct Options {
  bool json = false;
  // one that nobody else uses at the same time, most likely
  int domain = 130 + static_cast<int>(getpid() % 90);

  void add_to(CLI::App& app) {
    app.add_flag("--json", json, "print JSON");
    app.add_option("--domain", domain, "DDS domain to measure in; one of 130 to 219 otherwise")
        ->check(CLI::Range(0, 230))
        ->type_name("N");
  }
};

// Prints the failure; the exit code of docs/cli.md.
inline int exit_code(const Status& status) {
  if (status) {
    return 0;
  }
  std::cerr << "error: " << status.error().message << '\n';
  const ErrorCode code = status.error().code;
  return code == ErrorCode::kNotFound || code == ErrorCode::kTimeout ? 3 : 1;
}

}  // namespace nido::bench
