#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace nido {

// One thread for work that may wait for others, in the order of asking. Thread-safe.
class Worker {
 public:
  Worker() : thread_([this] { work(); }) {}
  // Waits for the work at hand; what waits behind it is dropped.
  ~Worker() {
    {
      const std::lock_guard lock(mutex_);
      stops_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  // false: too much waits already.
  bool add(std::function<void()> job) {
    constexpr std::size_t kMost = 16;
    {
      const std::lock_guard lock(mutex_);
      if (jobs_.size() >= kMost) return false;
      jobs_.push_back(std::move(job));
    }
    changed_.notify_all();
    return true;
  }

 private:
  void work() {
    std::unique_lock lock(mutex_);
    while (!stops_) {
      if (jobs_.empty()) {
        changed_.wait(lock);
        continue;
      }
      const auto job = std::move(jobs_.front());
      jobs_.pop_front();
      lock.unlock();
      job();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> jobs_;
  bool stops_ = false;
  std::thread thread_;
};

}  // namespace nido
