#pragma once

#include <chrono>
#include <string>

namespace nido {

// A progress bar on standard error; a line now and then where that is no terminal. Not thread-safe.
class ProgressBar {
 public:
  ProgressBar(std::string what, long total);
  // Ends the line.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void update(long done, const std::string& note = "");

 private:
  std::string what_;
  long total_;
  long shown_ = -1;
  bool terminal_;
  std::chrono::steady_clock::time_point start_;
};

// From its making on, SIGINT and SIGTERM set a flag instead of ending the program, so that an experiment can
// keep what is done. One at a time.
class InterruptFlag {
 public:
  InterruptFlag();
  ~InterruptFlag();
  InterruptFlag(const InterruptFlag&) = delete;
  InterruptFlag& operator=(const InterruptFlag&) = delete;
  [[nodiscard]] bool raised() const;
};

}  // namespace nido
