#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace nido {

// "Something changed": the one thing that threads wait for here. Look at the state after count(), wait for a
// later count.
class ChangeSignal {
 public:
  [[nodiscard]] std::uint64_t count() const {
    const std::lock_guard lock(mutex_);
    return count_;
  }
  void notify() {
    {
      const std::lock_guard lock(mutex_);
      ++count_;
    }
    changed_.notify_all();
  }
  // False when nothing changed since `seen` until the deadline.
  bool wait_until(std::uint64_t seen, std::chrono::steady_clock::time_point deadline) const {
    std::unique_lock lock(mutex_);
    return changed_.wait_until(lock, deadline, [&] { return count_ != seen; });
  }
  // Waits until holds() is true, asking after every change; false after timeout_s.
  template <class Predicate>
  bool wait(Predicate holds, double timeout_s) const {
    const auto deadline =
        std::chrono::steady_clock::now() +
        std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(timeout_s));
    for (;;) {
      const std::uint64_t seen = count();
      if (holds()) {
        return true;
      }
      if (!wait_until(seen, deadline)) {
        return holds();
      }
    }
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::uint64_t count_ = 0;
};

}  // namespace nido
