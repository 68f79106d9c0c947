// Round trips through a bare Unix socket: what the system itself takes.
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>

#include "child.h"
#include "ping_pong.h"
#include "unix_address.h"

namespace nido::bench {

namespace {

using Message = std::array<char, kMessage_bytes>;

class Asker final : public PingPong {
 public:
  ~Asker() override {
    close(connection_);
    close(listener_);
  }
  static Result<std::unique_ptr<PingPong>> make(int /*domain*/) {
    auto self = std::make_unique<Asker>();
    self->listener_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    const UnixAddress address(self->address());
    if (bind(self->listener_, address.get(), address.length) != 0 || listen(self->listener_, 1) != 0) {
      return Error{ErrorCode::kFailed, std::string("a Unix socket cannot be made: ") + std::strerror(errno)};
    }
    return std::unique_ptr<PingPong>(std::move(self));
  }
  std::string address() const override { return "nido-bench/" + std::to_string(getpid()); }
  Status connect() override {
    connection_ = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    const timeval limit{1, 0};
    setsockopt(connection_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    return {};
  }
  bool round_trip() override {
    return send(connection_, message_.data(), message_.size(), MSG_NOSIGNAL) > 0 &&
           recv(connection_, message_.data(), message_.size(), 0) > 0;
  }

 private:
  int listener_ = -1;
  int connection_ = -1;
  Message message_{};
};

Status answer(int /*domain*/, const std::string& name) {
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  const UnixAddress address(name);
  if (::connect(fd, address.get(), address.length) != 0) {
    return Error{ErrorCode::kNotFound, "the asking process is not there"};
  }
  end_with_parent();
  Message message{};
  while (recv(fd, message.data(), message.size(), 0) > 0 &&
         send(fd, message.data(), message.size(), MSG_NOSIGNAL) > 0) {
  }
  close(fd);
  return {};
}

}  // namespace

PingPongKind unix_socket() { return {"bare Unix socket", "rtt", "", Asker::make, answer}; }

}  // namespace nido::bench
