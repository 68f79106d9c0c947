#include "sockets.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>

namespace nido::yarp {
namespace {

std::optional<sockaddr_in> address_of(const std::string& host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  const std::string number = host == "localhost" ? "127.0.0.1" : host;
  if (inet_pton(AF_INET, number.c_str(), &address.sin_addr) != 1) return std::nullopt;
  return address;
}

Error no_address(const std::string& host) {
  return {ErrorCode::kInvalidArgument, fmt::format("'{}' is no address: four numbers are expected", host)};
}

Error failed(const std::string& what, const std::string& host, int port) {
  const ErrorCode code = errno == EADDRINUSE ? ErrorCode::kTaken : ErrorCode::kFailed;
  return {code, fmt::format("{} {}:{}: {}", what, host, port, std::strerror(errno))};
}

void hurry(int fd) {
  const int on = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

template <class Address>
const sockaddr* generic(const Address& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

}  // namespace

void Fd::reset() {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
}

bool is_loopback(const std::string& host) {
  const std::optional<sockaddr_in> address = address_of(host, 0);
  return address && (ntohl(address->sin_addr.s_addr) >> 24U) == 127;
}

Result<Fd> listen_tcp(const std::string& host, int port) {
  const std::optional<sockaddr_in> address = address_of(host, port);
  if (!address) return no_address(host);
  Fd fd(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int on = 1;
  setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (bind(fd.get(), generic(*address), sizeof *address) != 0 || listen(fd.get(), 128) != 0) {
    return failed("cannot listen on", host, port);
  }
  return fd;
}

Result<Fd> connect_tcp(const std::string& host, int port) {
  const std::optional<sockaddr_in> address = address_of(host, port);
  if (!address) return no_address(host);
  Fd fd(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (connect(fd.get(), generic(*address), sizeof *address) != 0 && errno != EINPROGRESS) {
    return failed("cannot connect to", host, port);
  }
  hurry(fd.get());
  return fd;
}

Result<Fd> open_udp(const std::string& host, int port, const std::string& peer, int peer_port) {
  const std::optional<sockaddr_in> address = address_of(host, port);
  if (!address) return no_address(host);
  Fd fd(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int on = 1;
  setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const int buffer = 1 << 20;
  setsockopt(fd.get(), SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer);
  setsockopt(fd.get(), SOL_SOCKET, SO_SNDBUF, &buffer, sizeof buffer);
  if (bind(fd.get(), generic(*address), sizeof *address) != 0) return failed("no datagrams on", host, port);
  if (!peer.empty()) {
    const std::optional<sockaddr_in> far = address_of(peer, peer_port);
    if (!far) return no_address(peer);
    if (connect(fd.get(), generic(*far), sizeof *far) != 0) return failed("no datagrams to", peer, peer_port);
  }
  return fd;
}

Fd accept_tcp(int listener, std::string& peer_host) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  Fd fd(accept4(listener, reinterpret_cast<sockaddr*>(&address), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (!fd.is_open()) return fd;
  char text[INET_ADDRSTRLEN] = {};
  inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
  peer_host = text;
  hurry(fd.get());
  return fd;
}

int local_port(int fd) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  return ntohs(address.sin_port);
}

Status connect_outcome(int fd) {
  int error = 0;
  socklen_t size = sizeof error;
  getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
  if (error != 0) return Error{ErrorCode::kNotFound, std::strerror(error)};
  return {};
}

}  // namespace nido::yarp
