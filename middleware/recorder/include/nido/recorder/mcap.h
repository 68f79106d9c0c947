#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

// The records of an MCAP file (https://mcap.dev/spec) that this project writes and reads. Times are
// nanoseconds since an epoch that the file's metadata names.
namespace nido::mcap {

struct Schema {
  std::uint16_t id = 0;  // never 0 in a file
  std::string name;      // "sensor_msgs::msg::Image"
  std::string encoding;  // "omgidl"
  std::string data;      // the text of the type and of those it is made of
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;   // 0: the type is not described
  std::string topic;             // "/icubSim/head/state:o"
  std::string message_encoding;  // "cdr"
  std::map<std::string, std::string> metadata;
};

// `data` belongs to whoever made the message.
struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;         // as counted by the source
  std::uint64_t log_time_ns = 0;      // when it was recorded
  std::uint64_t publish_time_ns = 0;  // when it was written by its source
  std::string_view data;
};

struct Metadata {
  std::string name;
  std::map<std::string, std::string> entries;
};

enum class Compression { kNone, kZstd };

}  // namespace nido::mcap
