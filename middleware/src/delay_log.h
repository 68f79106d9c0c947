#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>

namespace nido {

// How long messages were on their way, in classes that double from 1 us to 34 s. Not thread-safe.
class DelayLog {
 public:
  // In the order of arrival; both times of the same clock.
  void note(std::int64_t source_ns, std::int64_t arrival_ns) {
    const std::int64_t delay_ns = arrival_ns - source_ns;
    const auto delay_us = static_cast<std::uint64_t>(delay_ns < 0 ? 0 : delay_ns / 1000);
    const auto place = static_cast<std::size_t>(std::bit_width(delay_us));
    ++counts_[place < counts_.size() ? place : counts_.size() - 1];
    // late: when it came, the next one of its rhythm was due already
    if (last_source_ns_ != 0 && source_ns > last_source_ns_ && delay_ns > source_ns - last_source_ns_) {
      ++late_;
    }
    last_source_ns_ = source_ns;
  }
  // "late=2 us=64:130,128:12": messages that took less than 64 us (and no less than 32), ...
  [[nodiscard]] std::string text() const {
    std::string classes;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      if (counts_[i] > 0) {
        classes += (classes.empty() ? "" : ",") + std::to_string(std::uint64_t{1} << i) + ":" +
                   std::to_string(counts_[i]);
      }
    }
    return "late=" + std::to_string(late_) + " us=" + classes;
  }

 private:
  std::array<std::uint64_t, 26> counts_{};
  std::uint64_t late_ = 0;
  std::int64_t last_source_ns_ = 0;
};

}  // namespace nido
