#pragma once

#include <cstddef>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/middleware/raw_port.h"

namespace nido {

using Json = nlohmann::ordered_json;

// A message type that tools handle without knowing it at compile time: every type of msgs/idl is one.
struct AnyType {
  std::string name;  // "sensor_msgs/msg/Image"
  MessageType type;
  // Sequences of more than `longest` items are cut to {"length": n, "first": [...]}; 0: complete.
  std::function<Json(const void* message, std::size_t longest)> to_json;
  // Sets the fields that are named; the others stay. kInvalidArgument names the field, what was found and
  // what is allowed; the message is then to be thrown away.
  std::function<Status(const Json& value, void* message)> from_json;
  // Names of the fields, in order.
  std::vector<std::string> fields;
  // Bytes that a message takes on the wire.
  std::function<std::size_t(void* message)> wire_size;
};

// Every type, by name.
const std::vector<AnyType>& any_types();
// nullptr if there is none. Takes "sensor_msgs/msg/Image" and "sensor_msgs::msg::dds_::Image_".
const AnyType* find_any_type(const std::string& name);

// What a person types after `nido port write P`: one map in YAML or JSON ("{mode: position, joint: [0]}"), or
// fields
// ("mode=position joint=[0] header.frame_id=x"), or, for a type of one field, its value.
Result<Json> json_of_words(const AnyType& type, const std::vector<std::string>& words);

// A message for people: one line a field, long sequences cut.
std::string text_of(const Json& value);

}  // namespace nido
