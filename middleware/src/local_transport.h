#pragma once

#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>

namespace nido {

// User traffic between processes of one machine: Unix sockets of the kind that keeps messages apart
// (SOCK_SEQPACKET), with names in Linux's abstract namespace. The kernel knows when a process has ended,
// tells the others, and forgets its sockets; nothing is left in /dev/shm.
//
// The library's own shared memory cannot be used: a process that is started again gets the port file of its
// former life, and those that knew that one go on writing into the old, deleted file, for ever and unnoticed,
// if the process died while it worked on a message; the same happens between two living processes when both
// renew a port file that one of them found blocked, as on a busy machine.
//
// To the library this is a shared memory transport, so that it prefers it to UDP on one machine. Its
// addresses carry a mark and a changed host number, so that programs with the library's own shared memory
// (ROS 2 nodes) pass over them and use UDP.
struct LocalTransportDescriptor final : eprosima::fastdds::rtps::SharedMemTransportDescriptor {
  LocalTransportDescriptor();
  [[nodiscard]] eprosima::fastdds::rtps::TransportInterface* create_transport() const override;
};

}  // namespace nido
