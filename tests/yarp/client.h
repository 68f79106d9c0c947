#pragma once

// A minimal YARP program: blocking sockets, for tests.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "nido/yarp/stream.h"

namespace nido::yarp::test {

class Client {
 public:
  explicit Client(int port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    connected_ = connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    const timeval patience{10, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  }
  ~Client() { close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  [[nodiscard]] bool connected() const { return connected_; }
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t count = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (count <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(count));
    }
    return true;
  }
  // Exactly so many bytes; fewer when the connection ends or nothing comes.
  std::string receive(std::size_t count) {
    while (buffer_.size() < count && fill()) {
    }
    return take(std::min(count, buffer_.size()));
  }
  // A line with its end.
  std::string line() {
    std::size_t searched = 0;
    for (;;) {
      const std::size_t end = buffer_.find('\n', searched);
      if (end != std::string::npos) return take(end + 1);
      searched = buffer_.size();
      if (!fill()) return take(buffer_.size());
    }
  }
  // Says that nothing more will come.
  void shut_down() { shutdown(fd_, SHUT_WR); }
  std::string until_end() {
    while (fill()) {
    }
    return take(buffer_.size());
  }
  // Sends a message that wants a reply over carrier tcp, after greet().
  bool greet(Carrier carrier, const std::string& name) {
    if (!send(greeting(carrier, name))) return false;
    return is_text(carrier) ? line() == "Welcome " + name + "\r\n" : receive(8).size() == 8;
  }
  Bottle ask(const Bottle& request, Dialect dialect = Dialect::k3) {
    send(message(Carrier::kTcp, encode(request, dialect), {}, true));
    AnswerReader reader(Carrier::kTcp);
    for (;;) {
      const std::string byte = receive(1);
      if (byte.empty()) return {Value::string("no reply")};
      reader.feed(byte);
      const auto reply = reader.reply(dialect);
      if (reply && *reply) return (*reply)->bottle;
    }
  }

 private:
  bool fill() {
    char bytes[64 * 1024];
    const ssize_t got = recv(fd_, bytes, sizeof bytes, 0);
    if (got > 0) buffer_.append(bytes, static_cast<std::size_t>(got));
    return got > 0;
  }
  std::string take(std::size_t count) {
    std::string out = buffer_.substr(0, count);
    buffer_.erase(0, count);
    return out;
  }
  std::string buffer_;
  int fd_;
  bool connected_ = false;
};

}  // namespace nido::yarp::test
