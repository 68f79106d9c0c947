// Round trips through ZeroMQ over TCP, where libzmq3-dev is installed.
#include "ping_pong.h"

#ifdef NIDO_WITH_ZEROMQ
#include <zmq.h>

#include <array>

#include "child.h"

namespace nido::bench {

namespace {

class Socket {
 public:
  Socket() : context_(zmq_ctx_new()), socket_(zmq_socket(context_, ZMQ_PAIR)) {
    const int none = 0;
    zmq_setsockopt(socket_, ZMQ_LINGER, &none, sizeof none);
  }
  ~Socket() {
    zmq_close(socket_);
    zmq_ctx_term(context_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  [[nodiscard]] void* get() const { return socket_; }
  void give_up_after(int limit_ms) const {
    zmq_setsockopt(socket_, ZMQ_RCVTIMEO, &limit_ms, sizeof limit_ms);
  }

 private:
  void* context_;
  void* socket_;
};

using Message = std::array<char, kMessage_bytes>;

class Asker final : public PingPong {
 public:
  static Result<std::unique_ptr<PingPong>> make(int /*domain*/) {
    auto self = std::make_unique<Asker>();
    if (zmq_bind(self->socket_.get(), "tcp://127.0.0.1:*") != 0) {
      return Error{ErrorCode::kFailed, "ZeroMQ cannot listen on 127.0.0.1"};
    }
    return std::unique_ptr<PingPong>(std::move(self));
  }
  std::string address() const override {
    std::array<char, 256> text{};
    std::size_t size = text.size();
    zmq_getsockopt(socket_.get(), ZMQ_LAST_ENDPOINT, text.data(), &size);
    return text.data();
  }
  Status connect() override {
    socket_.give_up_after(20000);
    if (!round_trip()) {
      return Error{ErrorCode::kTimeout, "the answering process did not appear"};
    }
    socket_.give_up_after(1000);
    return {};
  }
  bool round_trip() override {
    return zmq_send(socket_.get(), message_.data(), message_.size(), 0) > 0 &&
           zmq_recv(socket_.get(), message_.data(), message_.size(), 0) > 0;
  }

 private:
  Socket socket_;
  Message message_{};
};

Status answer(int /*domain*/, const std::string& address) {
  const Socket socket;
  if (zmq_connect(socket.get(), address.c_str()) != 0) {
    return Error{ErrorCode::kNotFound, "the asking process is not there"};
  }
  end_with_parent();
  Message message{};
  while (zmq_recv(socket.get(), message.data(), message.size(), 0) > 0 &&
         zmq_send(socket.get(), message.data(), message.size(), 0) > 0) {
  }
  return {};
}

}  // namespace

PingPongKind zeromq_tcp() { return {"ZeroMQ over TCP", "rtt", "", Asker::make, answer}; }

}  // namespace nido::bench

#else

namespace nido::bench {

PingPongKind zeromq_tcp() {
  return {"ZeroMQ over TCP", "rtt", "not built in: package libzmq3-dev was not there", {}, {}};
}

}  // namespace nido::bench

#endif
