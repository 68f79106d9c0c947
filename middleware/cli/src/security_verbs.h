#pragma once

#include <CLI/CLI.hpp>

#include "session.h"

namespace nido::cli {

// `nido security init|add` (docs/network.md).
// `common` outlives the parsing.
void add_security(CLI::App& root, Common& common);

}  // namespace nido::cli
