#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <span>

#include "fd.h"

namespace nido {

// A packet of a lane's socket, perhaps with open files, at most two.
using LaneFiles = std::array<Fd, 2>;

// Without waiting. As of send(2) and recv(2): the bytes, or -1 and errno.
ssize_t send_packet(int socket, std::span<const unsigned char> bytes, std::span<const int> files);
ssize_t receive_packet(int socket, std::span<unsigned char> bytes, LaneFiles& files);

}  // namespace nido
