#pragma once

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>

namespace nido {

// The transports of Fast DDS 2.9.1 end the process (an assertion of their traffic statistics) when a message
// goes to an address before its output channel was opened, and the library does just that when a participant
// appears or leaves while another thread writes. These ones open the channel first; else they are the
// library's.
struct GuardedSharedMemoryDescriptor final : eprosima::fastdds::rtps::SharedMemTransportDescriptor {
  [[nodiscard]] eprosima::fastdds::rtps::TransportInterface* create_transport() const override;
};
struct GuardedUdpDescriptor final : eprosima::fastdds::rtps::UDPv4TransportDescriptor {
  [[nodiscard]] eprosima::fastdds::rtps::TransportInterface* create_transport() const override;
};

}  // namespace nido
