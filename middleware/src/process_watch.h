#pragma once

#include <signal.h>

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

namespace nido {

// SIGINT and SIGTERM of this process. The first one calls on_stop once; if the watch still exists 0.9 s
// later, or at a second signal, the process ends on the spot. Made before any other thread, so that all of
// them have the signals blocked.
class ProcessWatch {
 public:
  explicit ProcessWatch(std::function<void()> on_stop);
  ~ProcessWatch();
  ProcessWatch(const ProcessWatch&) = delete;
  ProcessWatch& operator=(const ProcessWatch&) = delete;

 private:
  void watch();
  std::function<void()> on_stop_;
  sigset_t old_mask_{};
  int signal_fd_ = -1;
  int end_fd_ = -1;
  std::thread thread_;
};

}  // namespace nido
