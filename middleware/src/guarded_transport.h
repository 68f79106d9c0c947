#pragma once

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

namespace nido {

// The UDP transport of Fast DDS 2.9.1 ends the process (an assertion of their traffic statistics) when a
// message goes to an address before its output channel was opened, and the library does just that when a
// participant appears or leaves while another thread writes. This one opens the channel first; else it is the
// library's.
struct GuardedUdpDescriptor final : eprosima::fastdds::rtps::UDPv4TransportDescriptor {
  [[nodiscard]] eprosima::fastdds::rtps::TransportInterface* create_transport() const override;
};

}  // namespace nido
