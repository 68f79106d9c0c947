#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <cstddef>
#include <cstring>
#include <string>

namespace nido::bench {

// A name in Linux's abstract namespace.
struct UnixAddress {
  sockaddr_un value{};
  socklen_t length = 0;
  explicit UnixAddress(const std::string& name) {
    value.sun_family = AF_UNIX;
    std::memcpy(value.sun_path + 1, name.data(), name.size());
    length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  }
  [[nodiscard]] const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&value); }
};

}  // namespace nido::bench
