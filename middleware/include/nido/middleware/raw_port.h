#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/middleware/port.h"
#include "nido/middleware/time.h"

namespace eprosima::fastdds::dds {
class TopicDataType;
}

namespace nido {

// How messages of one type are made and carried, without naming the type: what typed ports stand on
// (typed_port.h), and what tools that handle any type use (any_type.h).
struct MessageType {
  std::string dds_name;                                                  // "sensor_msgs::msg::dds_::Image_"
  std::function<std::shared_ptr<void>()> make_message;                   // an empty one
  std::function<eprosima::fastdds::dds::TopicDataType*()> make_support;  // the caller owns it
  // The type's definition, with those that it is made of, for tools that were not built with it; empty if
  // not known. Names as ROS 2 users know them: module pkg { module msg { struct Type { ... }; }; };
  std::string idl;
  [[nodiscard]] std::string ros_name() const;                   // "sensor_msgs/msg/Image"
  static std::string dds_name_of(const std::string& ros_name);  // the way back
};

// A message of the port's type with what is known of its journey.
struct RawReceived {
  std::shared_ptr<void> message;
  std::string source;          // name of the output port
  Time source_time;            // wall clock of the writer's computer
  std::uint64_t sequence = 0;  // 1 for the first message that the source wrote
};

// See Output<T> and Input<T> in port.h: the same, with the message as an address.
class RawOutput {
 public:
  virtual ~RawOutput() = default;
  virtual Status write(const void* message) = 0;
  [[nodiscard]] virtual std::size_t reader_count() const = 0;
  virtual bool wait_for_readers(std::size_t count, double timeout_s) = 0;
  [[nodiscard]] virtual const std::string& name() const = 0;
};

class RawInput {
 public:
  virtual ~RawInput() = default;
  virtual std::optional<RawReceived> take() = 0;
  virtual std::optional<RawReceived> take_latest() = 0;
  virtual bool wait_for_message(double timeout_s) = 0;
  virtual bool wait_for_sources(std::size_t count, double timeout_s) = 0;
  virtual Status connect(const std::string& output_name) = 0;
  virtual Status disconnect(const std::string& output_name) = 0;
  [[nodiscard]] virtual std::vector<ConnectionCounters> connections() const = 0;
  [[nodiscard]] virtual const std::string& name() const = 0;
};

}  // namespace nido
