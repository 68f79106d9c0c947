#pragma once

#include <CLI/CLI.hpp>

namespace nido::cli {

// `nido security init|add` (docs/network.md).
void add_security(CLI::App& root);

}  // namespace nido::cli
