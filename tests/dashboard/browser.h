#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <chrono>
#include <string>

namespace nido::test {

// What a browser does, by hand: one connection that sends any bytes and takes what comes.
class Browser {
 public:
  explicit Browser(int port) : port_(port), fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    is_open_ = connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~Browser() { close(fd_); }
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  [[nodiscard]] bool is_open() const { return is_open_; }
  void send(const std::string& bytes) {
    [[maybe_unused]] const ssize_t count = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  void get(const std::string& path) { send("GET " + path + " HTTP/1.1\r\nHost: " + host() + "\r\n\r\n"); }
  void post(const std::string& path, const std::string& body, const std::string& token,
            const std::string& more = "") {
    send("POST " + path + " HTTP/1.1\r\nHost: " + host() +
         "\r\nContent-Type: application/json\r\nX-Nido-Token: " + token + "\r\n" + more +
         "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  }
  [[nodiscard]] std::string host() const { return "127.0.0.1:" + std::to_string(port_); }

  // Reads until `text` has come; false when the far side closed or the time is over.
  bool wait_for(const std::string& text, double limit_s = 20) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(limit_s);
    while (got_.find(text) == std::string::npos) {
      if (std::chrono::steady_clock::now() > until || !read_some()) return false;
    }
    return true;
  }
  // Reads until the far side closes; false if that does not come.
  bool wait_for_end(double limit_s = 20) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(limit_s);
    while (std::chrono::steady_clock::now() < until) {
      if (!read_some() && closed_) return true;
    }
    return false;
  }
  // One whole reply with Content-Length: its head and its body.
  std::string reply() {
    if (!wait_for("\r\n\r\n")) return got_;
    const std::size_t head = got_.find("\r\n\r\n") + 4;
    const std::size_t at = got_.find("Content-Length: ");
    const std::size_t size = at < head ? std::stoul(got_.substr(at + 16)) : 0;
    while (got_.size() < head + size) {
      if (!read_some()) break;
    }
    std::string whole = got_.substr(0, head + size);
    got_.erase(0, head + size);
    return whole;
  }
  [[nodiscard]] const std::string& got() const { return got_; }
  void forget() { got_.clear(); }

 private:
  bool read_some() {
    const timeval limit{0, 200'000};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    char bytes[65536];
    const ssize_t count = recv(fd_, bytes, sizeof bytes, 0);
    if (count > 0) got_.append(bytes, static_cast<std::size_t>(count));
    closed_ = count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR);
    return !closed_;
  }

  int port_;
  int fd_;
  bool is_open_ = false;
  bool closed_ = false;
  std::string got_;
};

}  // namespace nido::test
