#pragma once

#include <atomic>
#include <cstdint>

namespace nido {

// The time that devices live in: nanoseconds since the start (simulated) or the epoch (wall). One clock is
// injected into all devices of a robot. Thread-safe.
class IClock {
 public:
  virtual ~IClock() = default;
  [[nodiscard]] virtual std::int64_t now_ns() const = 0;
};

// A clock that somebody moves: the robot process in simulated time, a test. Thread-safe.
class ManualClock final : public IClock {
 public:
  explicit ManualClock(std::int64_t start_ns = 0) : now_ns_(start_ns) {}
  [[nodiscard]] std::int64_t now_ns() const override { return now_ns_.load(); }
  void set_ns(std::int64_t now_ns) { now_ns_.store(now_ns); }
  void advance_ns(std::int64_t by_ns) { now_ns_.fetch_add(by_ns); }

 private:
  std::atomic<std::int64_t> now_ns_;
};

}  // namespace nido
