#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>

#include "nido/middleware/port.h"

namespace nido {

// Counts into ConnectionCounters::late and ::delays how long messages were on their way. Not thread-safe.
class DelayLog {
 public:
  // In the order of arrival; both times of the same clock.
  void note(std::int64_t source_ns, std::int64_t arrival_ns, ConnectionCounters& counters) {
    const std::int64_t delay_ns = arrival_ns - source_ns;
    const auto delay_us = static_cast<std::uint64_t>(delay_ns < 0 ? 0 : delay_ns / 1000);
    const auto place = static_cast<std::size_t>(std::bit_width(delay_us));
    ++counters.delays[place < counters.delays.size() ? place : counters.delays.size() - 1];
    if (last_source_ns_ != 0 && source_ns > last_source_ns_ && delay_ns > source_ns - last_source_ns_) {
      ++counters.late;
    }
    last_source_ns_ = source_ns;
  }

 private:
  std::int64_t last_source_ns_ = 0;
};

// "late=2 us=64:130,128:12": messages that took less than 64 us (and no less than 32), ...
inline std::string delay_text(const ConnectionCounters& counters) {
  std::string classes;
  for (std::size_t i = 0; i < counters.delays.size(); ++i) {
    if (counters.delays[i] > 0) {
      classes += (classes.empty() ? "" : ",") + std::to_string(std::uint64_t{1} << i) + ":" +
                 std::to_string(counters.delays[i]);
    }
  }
  return "late=" + std::to_string(counters.late) + " us=" + classes;
}

}  // namespace nido
