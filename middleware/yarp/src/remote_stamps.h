#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <thread>

#include "nido/yarp/bottle.h"
#include "nido/yarp/devices.h"

namespace nido::yarp {

// Turns the stamps of the far side into those of this one. The offset between the two clocks is taken from
// the message that was fastest in the last seconds. Not thread-safe.
class RemoteStamps {
 public:
  explicit RemoteStamps(const RemoteDevice& device) : mode_(device.stamps), now_ns_(device.now_ns) {}

  std::int64_t of(const std::string& envelope) {
    const std::int64_t now_ns = now_ns_();
    const Result<Stamp> stamp = parse_stamp(envelope);
    if (!stamp || !std::isfinite(stamp->time_s) || std::abs(stamp->time_s) > 1e10) return now_ns;
    const std::int64_t remote_ns = std::llround(stamp->time_s * 1e9);
    if (mode_ == StampMode::kRemote) return remote_ns;
    const std::int64_t offset_ns = now_ns - remote_ns;
    // two windows, so that the old one is forgotten without a jump to nothing
    constexpr std::int64_t kWindow_ns = 5'000'000'000;
    if (now_ns - window_start_ns_ > kWindow_ns || now_ns < window_start_ns_) {
      former_ns_ = newest_ns_;
      newest_ns_ = std::numeric_limits<std::int64_t>::max();
      window_start_ns_ = now_ns;
    }
    newest_ns_ = std::min(newest_ns_, offset_ns);
    return remote_ns + std::min(newest_ns_, former_ns_);
  }

 private:
  StampMode mode_;
  std::function<std::int64_t()> now_ns_;
  std::int64_t window_start_ns_ = std::numeric_limits<std::int64_t>::min() / 2;
  std::int64_t newest_ns_ = std::numeric_limits<std::int64_t>::max();
  std::int64_t former_ns_ = std::numeric_limits<std::int64_t>::max();
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
