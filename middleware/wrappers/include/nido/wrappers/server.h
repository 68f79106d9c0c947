#pragma once

#include <cstdint>

#include "nido/interfaces/result.h"

namespace nido {

// A device on the network. The robot process calls, once a control period and from one thread, first
// take_commands() of all servers, then steps the devices, then publish() of all servers. What people ask by
// text is answered on a thread of the middleware meanwhile: devices are thread-safe. Servers do not own their
// device; it must outlive them.
class IServer {
 public:
  virtual ~IServer() = default;
  // Hands the commands that have come to the device. Commands that are refused are logged, not failed.
  virtual Status take_commands() { return {}; }
  // Publishes what is due at this time of the robot's clock. Fails when the device fails.
  virtual Status publish(std::int64_t now_ns) = 0;
};

// When something periodic is due. Starts with the first time it is asked. Skips what was missed.
class Due {
 public:
  explicit Due(std::int64_t period_ns) : period_ns_(period_ns) {}
  // True at the first call and then once a period, at the first call of it; counted from the first one, so
  // that periods that are no multiple of the caller's do not drift.
  bool at(std::int64_t now_ns) {
    if (!started_) {
      started_ = true;
      first_ns_ = now_ns;
      count_ = 1;
      return true;
    }
    if (now_ns - first_ns_ < count_ * period_ns_) return false;
    count_ = (now_ns - first_ns_) / period_ns_ + 1;
    return true;
  }

 private:
  std::int64_t period_ns_;
  bool started_ = false;
  std::int64_t first_ns_ = 0;
  std::int64_t count_ = 0;  // periods begun
};

}  // namespace nido
