#include "process_watch.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <string>

namespace nido {

ProcessWatch::ProcessWatch(std::function<void()> on_stop) : on_stop_(std::move(on_stop)) {
  sigset_t mask;
  sigemptyset(&mask);
  sigaddset(&mask, SIGINT);
  sigaddset(&mask, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &mask, &old_mask_);
  signal_fd_ = signalfd(-1, &mask, SFD_CLOEXEC);
  end_fd_ = eventfd(0, EFD_CLOEXEC);
  thread_ = std::thread([this] { watch(); });
}

ProcessWatch::~ProcessWatch() {
  const std::uint64_t one = 1;
  // an eventfd takes eight bytes or none; with none the thread is over already
  [[maybe_unused]] const ssize_t written = write(end_fd_, &one, sizeof one);
  thread_.join();
  close(signal_fd_);
  close(end_fd_);
  pthread_sigmask(SIG_SETMASK, &old_mask_, nullptr);
}

void ProcessWatch::watch() {
  using Clock = std::chrono::steady_clock;
  int first_signal = 0;
  Clock::time_point deadline{};
  for (;;) {
    pollfd ends[2] = {{signal_fd_, POLLIN, 0}, {end_fd_, POLLIN, 0}};
    int timeout_ms = -1;
    if (first_signal != 0) {
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
      timeout_ms = left > 0 ? static_cast<int>(left) : 0;
    }
    const int ready = poll(ends, 2, timeout_ms);
    if ((ends[1].revents & POLLIN) != 0) {
      return;
    }
    const bool is_late = first_signal != 0 && Clock::now() >= deadline;
    signalfd_siginfo info{};
    const bool came =
        ready > 0 && (ends[0].revents & POLLIN) != 0 && read(signal_fd_, &info, sizeof info) == sizeof info;
    if (came && first_signal == 0) {
      first_signal = static_cast<int>(info.ssi_signo);
      deadline = Clock::now() + std::chrono::milliseconds(900);
      on_stop_();
    } else if (came || is_late) {
      _exit(128 + first_signal);
    }
  }
}

}  // namespace nido
