#pragma once

#include <string>
#include <utility>

#include "nido/interfaces/result.h"

namespace nido::yarp {

// A file descriptor that is closed with its owner.
class Fd {
 public:
  Fd() = default;
  explicit Fd(int fd) : fd_(fd) {}
  Fd(Fd&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Fd& operator=(Fd&& other) noexcept {
    if (this != &other) {
      reset();
      fd_ = std::exchange(other.fd_, -1);
    }
    return *this;
  }
  ~Fd() { reset(); }
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool is_open() const { return fd_ >= 0; }
  void reset();

 private:
  int fd_ = -1;
};

// Sockets of this computer's network, none of which blocks. Hosts are numbers ("127.0.0.1") or "localhost".

[[nodiscard]] bool is_loopback(const std::string& host);
Result<Fd> listen_tcp(const std::string& host, int port);
Result<Fd> connect_tcp(const std::string& host, int port);
// Bound to host:port (0: any free port), and to the peer if one is given.
Result<Fd> open_udp(const std::string& host, int port, const std::string& peer, int peer_port);
// The next connection of a listener; closed when there is none.
[[nodiscard]] Fd accept_tcp(int listener, std::string& peer_host);
[[nodiscard]] int local_port(int fd);
// Why a connection that was under way did not come about; ok if it did.
[[nodiscard]] Status connect_outcome(int fd);

}  // namespace nido::yarp
