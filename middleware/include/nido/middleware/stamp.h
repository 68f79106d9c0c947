#pragma once

#include <string>

#include "nido/middleware/time.h"
#include "nido/msgs/types.h"

namespace nido {

// The header of a message made at `time`; frame_id names the frame of its content, empty when it has none.
inline msgs::Header header_at(Time time, const std::string& frame_id = {}) {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  msgs::Header header;
  header.stamp().sec(static_cast<std::int32_t>(time.ns / kNsPerSecond));
  header.stamp().nanosec(static_cast<std::uint32_t>(time.ns % kNsPerSecond));
  header.frame_id(frame_id);
  return header;
}

// The source time of a message.
inline Time time_of(const msgs::Header& header) {
  return {static_cast<std::int64_t>(header.stamp().sec()) * 1'000'000'000 + header.stamp().nanosec()};
}

}  // namespace nido
