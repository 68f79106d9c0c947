#include "nido/dashboard/http_server.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <map>

namespace nido {
namespace {
using SteadyClock = std::chrono::steady_clock;

const char* reason_of(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 204:
      return "No Content";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 408:
      return "Request Timeout";
    case 413:
      return "Content Too Large";
    case 415:
      return "Unsupported Media Type";
    case 421:
      return "Misdirected Request";
    case 431:
      return "Request Header Fields Too Large";
    case 501:
      return "Not Implemented";
    case 503:
      return "Service Unavailable";
    case 505:
      return "HTTP Version Not Supported";
    default:
      return status < 500 ? "Bad Request" : "Internal Server Error";
  }
}

struct Connection {
  int fd = -1;
  HttpParser parser;
  std::string unsent;
  bool is_stream = false;
  bool waits_for_answer = false;  // the handler has its request; the next one is read when it has answered
  bool keep_alive = true;
  bool ends = false;                                   // closed when everything is sent
  SteadyClock::time_point since = SteadyClock::now();  // of the last thing that it did
  SteadyClock::time_point request_since = SteadyClock::now();
};

class HttpServerImpl final : public HttpServer {
 public:
  HttpServerImpl(yarp::EventLoop& loop, HttpServerOptions options, Handler handler)
      : loop_(loop), options_(options), handler_(std::move(handler)) {}

  ~HttpServerImpl() override {
    *alive_ = nullptr;
    while (!connections_.empty()) close_connection(connections_.begin()->first);
    if (listen_fd_ >= 0) {
      loop_.unwatch(listen_fd_);
      close(listen_fd_);
    }
  }

  Status open() {
    listen_fd_ = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (listen_fd_ < 0) return Error{ErrorCode::kFailed, fmt::format("no socket: {}", std::strerror(errno))};
    const int yes = 1;
    // a port whose last owner has just gone is free
    setsockopt(listen_fd_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(options_.port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (bind(listen_fd_, reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
        listen(listen_fd_, 64) != 0) {
      const int error = errno;
      if (error == EADDRINUSE) {
        return Error{ErrorCode::kTaken,
                     fmt::format("port {} of 127.0.0.1 is taken by another program: choose another "
                                 "one",
                                 options_.port)};
      }
      return Error{
          error == EACCES ? ErrorCode::kInvalidArgument : ErrorCode::kFailed,
          fmt::format("port {} of 127.0.0.1 cannot be listened on: {}", options_.port, std::strerror(error))};
    }
    getsockname(listen_fd_, reinterpret_cast<sockaddr*>(&address), &size);
    options_.port = ntohs(address.sin_port);
    loop_.every(1.0, [alive = alive_] {
      if (*alive != nullptr) (*alive)->look_at_times();
    });
    return loop_.watch(listen_fd_, true, false, [this](yarp::EventLoop::Happened) { accept_all(); });
  }

  [[nodiscard]] int port() const override { return options_.port; }
  [[nodiscard]] std::size_t streams() const override { return streams_; }

  void broadcast(const std::string& bytes) override {
    std::vector<std::uint64_t> ids;
    for (const auto& [id, connection] : connections_) {
      if (connection.is_stream && !connection.ends) ids.push_back(id);
    }
    for (const std::uint64_t id : ids) {
      connections_[id].unsent += bytes;
      send_some(id);
    }
  }

 private:
  void accept_all() {
    for (;;) {
      const int fd = accept4(listen_fd_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
      if (fd < 0) return;
      if (connections_.size() >= options_.connections && !close_idlest()) {
        // everybody is at work: this one is not
        close(fd);
        continue;
      }
      const int yes = 1;
      setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
      const std::uint64_t id = ++ids_;
      Connection& connection = connections_[id];
      connection.fd = fd;
      connection.parser = HttpParser(options_.bounds);
      const Status watched =
          loop_.watch(fd, true, false, [this, id](yarp::EventLoop::Happened what) { happened(id, what); });
      if (!watched) close_connection(id);
    }
  }

  // Makes room; false if no connection is idle.
  bool close_idlest() {
    std::uint64_t idlest = 0;
    for (const auto& [id, connection] : connections_) {
      if (connection.is_stream || connection.waits_for_answer || !connection.unsent.empty()) continue;
      if (idlest == 0 || connection.since < connections_[idlest].since) idlest = id;
    }
    if (idlest == 0) return false;
    close_connection(idlest);
    return true;
  }

  void close_connection(std::uint64_t id) {
    const auto found = connections_.find(id);
    if (found == connections_.end()) return;
    loop_.unwatch(found->second.fd);
    close(found->second.fd);
    if (found->second.is_stream) --streams_;
    connections_.erase(found);
  }

  void happened(std::uint64_t id, yarp::EventLoop::Happened what) {
    if (what.broken) return close_connection(id);
    if (what.writable) send_some(id);
    if (what.readable && connections_.contains(id)) read_some(id);
  }

  void read_some(std::uint64_t id) {
    Connection& connection = connections_[id];
    std::array<char, 4096> bytes{};
    const ssize_t count = read(connection.fd, bytes.data(), bytes.size());
    if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) return close_connection(id);
    if (count < 0) return;
    // a stream has nothing more to say
    if (connection.is_stream || connection.ends) return;
    connection.since = SteadyClock::now();
    if (!connection.parser.begun()) connection.request_since = connection.since;
    connection.parser.add({bytes.data(), static_cast<std::size_t>(count)});
    take_requests(id);
  }

  void take_requests(std::uint64_t id) {
    const auto found = connections_.find(id);
    if (found == connections_.end()) return;
    Connection& connection = found->second;
    if (connection.ends || connection.is_stream) return;
    if (connection.waits_for_answer) {
      // it may send ahead what one request may hold, and no more
      if (connection.parser.kept_bytes() > options_.bounds.head_bytes + options_.bounds.body_bytes) {
        close_connection(id);
      }
      return;
    }
    const auto request = connection.parser.next();
    if (const auto& refusal = connection.parser.refusal()) {
      connection.keep_alive = false;
      return answer(id, {refusal->status, "text/plain; charset=utf-8", refusal->sentence + "\n", {}, false});
    }
    if (!request) return;
    connection.keep_alive = request->keep_alive;
    connection.waits_for_answer = true;
    if (!names_this_host(*request)) {
      connection.keep_alive = false;
      return answer(id, {421,
                         "text/plain; charset=utf-8",
                         fmt::format("this is 127.0.0.1:{} and nobody else\n", options_.port),
                         {},
                         false});
    }
    handler_(*request, [this_alive = alive_, id, &loop = loop_](HttpReply reply) {
      loop.post([this_alive, id, reply = std::move(reply)]() mutable {
        if (*this_alive != nullptr) (*this_alive)->answer(id, std::move(reply));
      });
    });
  }

  [[nodiscard]] bool names_this_host(const HttpRequest& request) const {
    const auto host = request.headers.find("host");
    if (host == request.headers.end()) return false;
    const std::string own_port = fmt::format(":{}", options_.port);
    return host->second == "127.0.0.1" + own_port || host->second == "localhost" + own_port ||
           (options_.port == 80 && (host->second == "127.0.0.1" || host->second == "localhost"));
  }

  void answer(std::uint64_t id, HttpReply reply) {
    const auto found = connections_.find(id);
    if (found == connections_.end()) return;
    Connection& connection = found->second;
    connection.waits_for_answer = false;
    connection.since = connection.request_since = SteadyClock::now();
    if (reply.is_stream && streams_ >= options_.streams) {
      reply = {503,
               "text/plain; charset=utf-8",
               fmt::format("{} pages look on already: close one\n", options_.streams),
               {},
               false};
    }
    std::string head = fmt::format("HTTP/1.1 {} {}\r\n", reply.status, reason_of(reply.status));
    if (!reply.type.empty()) head += fmt::format("Content-Type: {}\r\n", reply.type);
    head +=
        "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n"
        "Cross-Origin-Resource-Policy: same-origin\r\nX-Frame-Options: DENY\r\n";
    for (const auto& [name, value] : reply.headers) head += name + ": " + value + "\r\n";
    if (reply.is_stream) {
      connection.is_stream = true;
      ++streams_;
      head += "Connection: keep-alive\r\n\r\n";
    } else {
      connection.ends = !connection.keep_alive;
      head += fmt::format("Content-Length: {}\r\nConnection: {}\r\n\r\n", reply.body.size(),
                          connection.keep_alive ? "keep-alive" : "close");
    }
    connection.unsent += head + reply.body;
    send_some(id);
    // what was sent ahead
    take_requests(id);
  }

  void send_some(std::uint64_t id) {
    Connection& connection = connections_[id];
    while (!connection.unsent.empty()) {
      const ssize_t count =
          send(connection.fd, connection.unsent.data(), connection.unsent.size(), MSG_NOSIGNAL);
      if (count < 0 && errno == EINTR) continue;
      if (count < 0 && errno == EAGAIN) break;
      if (count <= 0) return close_connection(id);
      connection.unsent.erase(0, static_cast<std::size_t>(count));
      connection.since = SteadyClock::now();
    }
    if (connection.unsent.size() > options_.unsent_bytes) return close_connection(id);
    if (connection.unsent.empty() && connection.ends) return close_connection(id);
    loop_.change(connection.fd, true, !connection.unsent.empty());
  }

  void look_at_times() {
    const auto now = SteadyClock::now();
    const auto older = [now](SteadyClock::time_point then, double limit_s) {
      return std::chrono::duration<double>(now - then).count() > limit_s;
    };
    std::vector<std::uint64_t> over;
    std::vector<std::uint64_t> slow;
    for (const auto& [id, connection] : connections_) {
      if (!connection.unsent.empty()) {
        // a client that does not read
        if (older(connection.since, options_.idle_s)) over.push_back(id);
      } else if (connection.is_stream || connection.waits_for_answer) {
        continue;
      } else if (connection.parser.begun() && older(connection.request_since, options_.request_s)) {
        slow.push_back(id);
      } else if (older(connection.since, options_.idle_s)) {
        over.push_back(id);
      }
    }
    for (const std::uint64_t id : over) close_connection(id);
    for (const std::uint64_t id : slow) {
      connections_[id].keep_alive = false;
      answer(id, {408, "text/plain; charset=utf-8", "the request did not come to its end\n", {}, false});
    }
  }

  yarp::EventLoop& loop_;
  HttpServerOptions options_;
  Handler handler_;
  std::shared_ptr<HttpServerImpl*> alive_ = std::make_shared<HttpServerImpl*>(this);
  int listen_fd_ = -1;
  std::uint64_t ids_ = 0;
  std::map<std::uint64_t, Connection> connections_;
  std::atomic<std::size_t> streams_ = 0;
};

}  // namespace

Result<std::unique_ptr<HttpServer>> HttpServer::open(yarp::EventLoop& loop, HttpServerOptions options,
                                                     Handler handler) {
  auto server = std::make_unique<HttpServerImpl>(loop, options, std::move(handler));
  if (Status opened = server->open(); !opened) return opened.error();
  return std::unique_ptr<HttpServer>(std::move(server));
}

}  // namespace nido
