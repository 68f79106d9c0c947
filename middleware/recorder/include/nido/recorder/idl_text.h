#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace nido {

// The IDL text of a message type of msgs/idl and of all types that it is made of; empty for other types.
// Types are named as in ROS 2: "sensor_msgs/msg/Image", in the text sensor_msgs::msg::Image.
std::string_view idl_text_of(std::string_view ros_name);

// All types that have a text.
std::vector<std::string_view> idl_types();

// "sensor_msgs/msg/Image" -> "sensor_msgs::msg::Image", and the way back.
std::string scoped_name_of(std::string_view ros_name);
std::string ros_name_of(std::string_view scoped_name);

}  // namespace nido
