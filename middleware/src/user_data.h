#pragma once

#include <string>
#include <vector>

#include "participant.h"

namespace nido {

// What an endpoint tells about itself in its DDS user data: "key=value;" pairs, as ROS 2 writes them.
//   nido=1;node=vision;port=/vision/objects:o;profile=event;lane=PLACE;typehash=RIHS01_...;
// PLACE is where lanes reach it (lane_wire.h). The type hash (REP 2016) is there for message types; a ROS 2
// program of Iron or later compares it with its own.
struct EndpointUserData {
  std::string node;
  std::string port;
  std::string profile;
  std::string dds_type;      // "std_msgs::msg::dds_::String_"
  std::string lane_place{};  // empty: there are no lanes to it
};
std::vector<unsigned char> pack_user_data(const EndpointUserData& data);

// Fills node, port and profile of an endpoint of nido; leaves them empty for those of others.
void unpack_user_data(const std::vector<unsigned char>& data, EndpointInfo& info);

// "RIHS01_..."; empty for a type that is not one of nido's messages.
std::string type_hash_of(const std::string& dds_type);

}  // namespace nido
