#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "nido/dashboard/http_request.h"
#include "nido/interfaces/result.h"
#include "nido/yarp/event_loop.h"

namespace nido {

struct HttpReply {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;
  // Server-sent events: the connection stays open, the body is what it begins with, and broadcast() reaches
  // it.
  bool is_stream = false;
};

struct HttpServerOptions {
  int port = 8080;                       // 0: a free one
  std::size_t connections = 64;          // at most; beyond, the one that has been idle longest goes
  std::size_t streams = 8;               // at most, of these
  std::size_t unsent_bytes = 4'000'000;  // of a client that does not read; more ends its connection
  double request_s = 5;                  // within which a request must be complete
  double idle_s = 30;                    // after which a silent connection is closed
  HttpBounds bounds;
};

// An HTTP server on 127.0.0.1 for pages of this computer's own people. One thread serves everybody; what one
// client may take of it is bounded. Requests that name another host than this one are refused, so that no
// page from elsewhere gets through by a name that it lets point here (DNS rebinding). All functions are for
// the loop's thread, except where said.
class HttpServer {
 public:
  // Answers once, now or later, from any thread; what comes after the connection's end is dropped.
  using Respond = std::function<void(HttpReply)>;
  using Handler = std::function<void(const HttpRequest&, Respond)>;

  // kTaken if somebody else listens on the port. `loop` must outlive the server.
  static Result<std::unique_ptr<HttpServer>> open(yarp::EventLoop& loop, HttpServerOptions options,
                                                  Handler handler);
  virtual ~HttpServer() = default;

  [[nodiscard]] virtual int port() const = 0;
  // Sends bytes to every stream.
  virtual void broadcast(const std::string& bytes) = 0;
  // Number of streams. Thread-safe.
  [[nodiscard]] virtual std::size_t streams() const = 0;
};

}  // namespace nido
