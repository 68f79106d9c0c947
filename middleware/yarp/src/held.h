#pragma once

#include <atomic>
#include <cstddef>
#include <memory>

namespace nido::yarp {

// Bytes that the connections of one host, and the messages that are worked on, keep together. Thread-safe.
using HeldTotal = std::shared_ptr<std::atomic<std::size_t>>;

// One holder's part of them, as long as it lives.
class Held {
 public:
  explicit Held(HeldTotal total, std::size_t bytes = 0) : total_(std::move(total)) { set(bytes); }
  ~Held() { set(0); }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;

  void set(std::size_t bytes) {
    *total_ += bytes - bytes_;  // modulo 2^n: smaller too
    bytes_ = bytes;
  }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::size_t total() const { return *total_; }

 private:
  HeldTotal total_;
  std::size_t bytes_ = 0;
};

}  // namespace nido::yarp
