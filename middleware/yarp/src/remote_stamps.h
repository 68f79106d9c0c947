#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <utility>

#include "nido/yarp/bottle.h"
#include "nido/yarp/devices.h"

namespace nido::yarp {

// The offset between two clocks, from what is seen of messages. Not thread-safe.
class ClockOffset {
 public:
  std::int64_t to_own(std::int64_t remote_ns, std::int64_t now_ns) {
    // the far side has been started again, or its clock was set back: what was seen before says nothing
    if (remote_ns < newest_remote_ns_ - kJump_ns) *this = ClockOffset();
    newest_remote_ns_ = std::max(newest_remote_ns_, remote_ns);
    for (std::size_t i = 0; i < std::min(next_, known_.size()); ++i) {
      if (known_[i].first == remote_ns) return known_[i].second;
    }
    // two windows, so that the old one is forgotten without a jump to nothing
    constexpr std::int64_t kWindow_ns = 5'000'000'000;
    if (now_ns - window_start_ns_ > kWindow_ns || now_ns < window_start_ns_) {
      former_ns_ = newest_ns_;
      newest_ns_ = kNothing;
      window_start_ns_ = now_ns;
    }
    newest_ns_ = std::min(newest_ns_, now_ns - remote_ns);
    const std::int64_t own_ns = remote_ns + std::min(newest_ns_, former_ns_);
    known_[next_++ % known_.size()] = {remote_ns, own_ns};
    return own_ns;
  }

 private:
  static constexpr std::int64_t kNothing = std::numeric_limits<std::int64_t>::max();
  static constexpr std::int64_t kJump_ns = 1'000'000'000;
  std::int64_t newest_remote_ns_ = std::numeric_limits<std::int64_t>::min() / 2;
  std::int64_t window_start_ns_ = std::numeric_limits<std::int64_t>::min() / 2;
  std::int64_t newest_ns_ = kNothing;
  std::int64_t former_ns_ = kNothing;
  std::array<std::pair<std::int64_t, std::int64_t>, 128> known_{};
  std::size_t next_ = 0;
};

// The far side's time as ours: one offset for all, chosen once, and anew when the far side's clock is set.
// Not thread-safe.
class FollowedTime {
 public:
  // The newest stamp that has come is own_ns.
  void start(std::int64_t own_ns) {
    offset_ns_ = own_ns - newest_ns_;
    is_started_ = true;
  }
  [[nodiscard]] bool is_started() const { return is_started_; }
  [[nodiscard]] std::int64_t newest_own_ns() const { return newest_ns_ + offset_ns_; }

  // Any stamp that comes, also before start().
  std::int64_t to_own(std::int64_t remote_ns, std::int64_t now_ns) {
    if (!has_any_ || std::abs(remote_ns - newest_ns_) <= kJump_ns) {
      if (!has_any_ && is_started_) offset_ns_ = now_ns - remote_ns;
      newest_ns_ = has_any_ ? std::max(newest_ns_, remote_ns) : remote_ns;
      has_any_ = true;
      strange_ = 0;
      return remote_ns + offset_ns_;
    }
    // one odd stamp is late or wrong; if there are only such, the clock was set or messages were missing
    if (++strange_ < kEnough) return now_ns;
    strange_ = 0;
    newest_ns_ = remote_ns;
    if (std::abs(remote_ns + offset_ns_ - now_ns) > kJump_ns) offset_ns_ = now_ns - remote_ns;
    return remote_ns + offset_ns_;
  }

 private:
  static constexpr std::int64_t kJump_ns = 1'000'000'000;
  static constexpr int kEnough = 20;
  bool is_started_ = false;
  bool has_any_ = false;
  std::int64_t newest_ns_ = 0;  // of the far side
  std::int64_t offset_ns_ = 0;
  int strange_ = 0;  // stamps in a row that do not fit the newest one
};

// The stamps of one device's messages.
class RemoteStamps {
 public:
  RemoteStamps(const RemoteDevice& device, Network& network)
      : mode_(device.stamps), now_ns_(device.now_ns), network_(network) {}

  std::int64_t of(const std::string& envelope) const {
    const std::int64_t now_ns = now_ns_();
    const Result<Stamp> stamp = parse_stamp(envelope);
    if (!stamp || !std::isfinite(stamp->time_s) || std::abs(stamp->time_s) > 4e9) return now_ns;
    const std::int64_t remote_ns = std::llround(stamp->time_s * 1e9);
    return mode_ == StampMode::kRemote ? remote_ns : network_.to_own_clock(remote_ns, now_ns);
  }

 private:
  StampMode mode_;
  std::function<std::int64_t()> now_ns_;
  Network& network_;
};

// Waits for the first reading of a device that was connected just now; what read() said last otherwise.
template <class Read>
Status wait_for_first(Read read) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(3);
  for (;;) {
    const auto reading = read();
    if (reading.ok()) return {};
    if (std::chrono::steady_clock::now() > end) return reading.error();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

}  // namespace nido::yarp
