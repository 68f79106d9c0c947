#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/report/progress.h"

namespace nido {

// A running `nido launch APP ARGUMENTS...` (the program beside this one), for experiments. Ctrl-C reaches it
// as it reaches this process; when this process, or the thread that started the app, ends in any way, the app
// is asked to end (SIGTERM). Thread-compatible; move-only.
class LaunchedApp {
 public:
  // Its output goes to the file `log`. kFailed, or kNotFound when the programs are not there.
  static Result<LaunchedApp> start(const std::string& app, const std::vector<std::string>& arguments,
                                   const std::string& log);
  // An app that still runs is interrupted and waited for.
  ~LaunchedApp();
  LaunchedApp(LaunchedApp&& other) noexcept;
  LaunchedApp& operator=(LaunchedApp&&) = delete;
  LaunchedApp(const LaunchedApp&) = delete;
  LaunchedApp& operator=(const LaunchedApp&) = delete;

  // How it ended, or nothing while it runs. kInterrupted if it was interrupted, kFailed with its exit code
  // and the log's place if it did not do its job. Does not block.
  std::optional<Status> poll();
  // Blocks until it ended.
  Status wait();

 private:
  LaunchedApp(pid_t pid, std::string app, std::string log)
      : pid_(pid), app_(std::move(app)), log_(std::move(log)) {}
  std::optional<Status> reap(int flags);
  pid_t pid_;  // -1: moved from, or ended
  std::string app_;
  std::string log_;
  std::optional<Status> ended_;
};

// Runs an app to its end; an interruption ends it at once, with kInterrupted.
Status run_app(const std::string& app, const std::vector<std::string>& arguments, const std::string& log,
               const InterruptFlag& interrupt);

}  // namespace nido
