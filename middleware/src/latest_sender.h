#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

namespace nido {

// Sends on a thread of its own what may be dropped: a slow network then holds up pictures, and not who writes
// them. While a message is being sent, the newest one waits; it takes the place of one that waited already.
// Thread-safe.
class LatestSender {
 public:
  // `send`: is called with one message after the other, as posted. It may take long.
  using Send = std::function<void(std::span<const std::uint8_t> payload, std::uint64_t sequence)>;
  explicit LatestSender(Send send) : send_(std::move(send)) {}
  // Waits for the message that is being sent; the one that waits is given up.
  ~LatestSender();
  LatestSender(const LatestSender&) = delete;
  LatestSender& operator=(const LatestSender&) = delete;

  // Copies the message; does not wait. The thread begins with the first one.
  void post(std::span<const std::uint8_t> payload, std::uint64_t sequence);

 private:
  void work();

  const Send send_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::uint8_t> waiting_;  // its storage is used again
  std::uint64_t waiting_sequence_ = 0;
  bool has_waiting_ = false;
  bool is_over_ = false;
  std::thread thread_;
};

}  // namespace nido
