#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nido/launcher/schema.h"

namespace nido {

// `nido launch`, as typed.
struct LaunchRequest {
  std::string app;                // name or file
  std::vector<std::string> sets;  // --set, in order
  std::vector<Override> options;  // the other options, as overrides of the app's defaults
  std::string out;                // --out; empty: out/TIME-APP, and out/latest
  std::string record;             // --record: all ports go into this MCAP file; empty: none
  std::string dashboard;  // --dashboard: port of 127.0.0.1 for the page, "0" for a free one; empty: no page
  bool verbose = false;   // the processes' output on the terminal
  bool dump = false;      // only print the app with every default filled in
  bool json = false;      // the outcome as one JSON object on stdout
};

// Runs an app until its outcome, its time, a failure or an interruption, and prints its story. Returns the
// exit code of docs/cli.md. Blocks SIGINT, SIGTERM, SIGHUP in this process and handles them itself: call it
// from main's thread, before any other thread is made.
int run_launch(const LaunchRequest& request);

}  // namespace nido
