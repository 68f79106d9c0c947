#include "latest_sender.h"

#include <system_error>

namespace nido {

LatestSender::~LatestSender() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void LatestSender::post(std::span<const std::uint8_t> payload, std::uint64_t sequence) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.assign(payload.begin(), payload.end());
    waiting_sequence_ = sequence;
    has_waiting_ = true;
    if (!thread_.joinable()) {
      try {
        thread_ = std::thread([this] { work(); });
      } catch (const std::system_error&) {
        return;  // no more threads: this one is dropped, and the next one tries again
      }
    }
  }
  changed_.notify_one();
}

void LatestSender::work() {
  std::vector<std::uint8_t> payload;
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return has_waiting_ || is_over_; });
    if (is_over_) {
      return;
    }
    payload.swap(waiting_);
    const std::uint64_t sequence = waiting_sequence_;
    has_waiting_ = false;
    lock.unlock();
    send_(payload, sequence);
    lock.lock();
  }
}

}  // namespace nido
