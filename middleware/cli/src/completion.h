#pragma once

#include <string>
#include <vector>

#include "session.h"

namespace CLI {
class App;
}

namespace nido::cli {

// `nido completion SHELL`: prints the script for bash or zsh, which asks `nido complete` at every tabulator.
int completion(const std::string& shell);

// `nido complete WORD...`: what the last of these words, which may be empty, can become: verbs, options, and
// what is there now, one a line. The command line itself tells which verbs and options there are.
int complete(CLI::App& root, const std::vector<std::string>& words, Common common);

}  // namespace nido::cli
