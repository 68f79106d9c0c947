#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "nido/recorder/mcap_reader.h"

namespace nido::test {

struct Kept {
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::string data;
  bool operator==(const Kept&) const = default;
};
using Contents = std::map<std::string, std::vector<Kept>>;

// Everything that the reader hands out, by topic, in its order.
inline Contents contents_of(mcap::Reader& reader) {
  Contents contents;
  for (const auto& [id, channel] : reader.channels()) contents[channel.topic];
  reader.rewind();
  while (const auto message = reader.next()) {
    contents[reader.channels().at(message->channel_id).topic].push_back(
        {message->sequence, message->log_time_ns, message->publish_time_ns, std::string(message->data)});
  }
  return contents;
}

inline Contents contents_of(const std::string& file) {
  auto reader = mcap::Reader::open(file);
  EXPECT_TRUE(reader.ok()) << reader.error().message;
  return reader ? contents_of(**reader) : Contents();
}

// The messages without their times.
inline std::vector<std::string> data_of(const std::vector<Kept>& messages) {
  std::vector<std::string> data;
  for (const auto& message : messages) data.push_back(message.data);
  return data;
}

}  // namespace nido::test
