#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "nido/middleware/raw_port.h"

namespace nido {

// What all ports of a recording share. Thread-safe.
struct RawIntake {
  std::size_t most_bytes = 0;  // that may wait to be written; 0: no bound
  std::atomic<std::size_t> waiting_bytes{0};
  // simulated time, once /clock has told it; -1 before
  std::atomic<std::int64_t> clock_ns{-1};
};

// A message of any type as it travels: CDR, with the four bytes in front that say how it is laid out.
class RawMessage {
 public:
  RawMessage() = default;
  explicit RawMessage(std::string_view bytes);
  RawMessage(const RawMessage&) = delete;
  RawMessage& operator=(const RawMessage&) = delete;
  ~RawMessage();

  // For what DDS hands over: takes a copy and the time, or only the time if the intake is full.
  void arrive(std::string_view bytes, const std::shared_ptr<RawIntake>& intake);

  [[nodiscard]] std::string_view bytes() const { return {bytes_.get(), size_}; }
  // It came, but there was no room for it.
  [[nodiscard]] bool dropped() const { return dropped_; }
  [[nodiscard]] std::int64_t arrival_ns() const { return arrival_ns_; }  // wall clock
  [[nodiscard]] std::int64_t clock_ns() const { return clock_ns_; }      // of the intake, at that moment

 private:
  std::unique_ptr<char[]> bytes_;
  std::size_t size_ = 0;
  bool dropped_ = false;
  std::int64_t arrival_ns_ = 0;
  std::int64_t clock_ns_ = -1;
  std::shared_ptr<RawIntake> intake_;
};

// The type of a port whose messages are RawMessage, whatever is in them. A process uses either this or the
// real type of a name, not both on one node. `is_clock`: of rosgraph_msgs/msg/Clock, whose messages set the
// intake's clock.
MessageType raw_message_type(const std::string& ros_name, std::shared_ptr<RawIntake> intake = nullptr,
                             bool is_clock = false);

// A type that nodes use themselves, so that a node that is seen by others reads and writes it in one way
// already. Only a hidden node can have raw ports of it.
bool is_own_type(const std::string& ros_name);

// The time in a serialized rosgraph_msgs/msg/Clock, and the way back; -1 if it is none.
std::int64_t clock_of_bytes(std::string_view bytes);
std::string bytes_of_clock(std::int64_t time_ns);

}  // namespace nido
