#pragma once

#include <cstdint>
#include <string>

#include "nido/msgs/types.h"

namespace nido {

// Between the robot's clock and the stamps of messages.
inline msgs::Time to_message(std::int64_t ns) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  std::int64_t seconds = ns / kSecond_ns;
  std::int64_t rest_ns = ns % kSecond_ns;
  if (rest_ns < 0) {
    rest_ns += kSecond_ns;
    --seconds;
  }
  msgs::Time time;
  time.sec(static_cast<std::int32_t>(seconds));
  time.nanosec(static_cast<std::uint32_t>(rest_ns));
  return time;
}
inline std::int64_t to_ns(const msgs::Time& time) {
  return static_cast<std::int64_t>(time.sec()) * 1'000'000'000 + time.nanosec();
}
inline msgs::Header header(std::int64_t ns, const std::string& frame_id) {
  msgs::Header header;
  header.stamp(to_message(ns));
  header.frame_id(frame_id);
  return header;
}

}  // namespace nido
