#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace nido {

// A request as a browser sends it, checked.
struct HttpRequest {
  std::string method;  // "GET", "POST"
  std::string path;    // "/camera", undecoded, without the query
  std::map<std::string, std::string> query;
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;
  bool keep_alive = true;
};

// What a server answers to a request that it does not take.
struct HttpRefusal {
  int status = 400;
  std::string sentence;
};

struct HttpBounds {
  std::size_t head_bytes = 8192;  // request line and headers
  std::size_t headers = 64;
  std::size_t body_bytes = 8192;
};

// Takes one request at a time from the bytes of a connection. Strict: HTTP/1.0 and 1.1, lines that end in CR
// LF, plain ASCII, one Host, a body only with Content-Length. Not thread-safe.
class HttpParser {
 public:
  explicit HttpParser(HttpBounds bounds = {}) : bounds_(bounds) {}

  void add(std::string_view bytes) { bytes_.append(bytes); }
  // The next request, if it is complete; a refusal is final.
  std::optional<HttpRequest> next();
  [[nodiscard]] const std::optional<HttpRefusal>& refusal() const { return refusal_; }
  // Part of a request has come.
  [[nodiscard]] bool begun() const { return head_.has_value() || !bytes_.empty(); }
  [[nodiscard]] std::size_t kept_bytes() const { return bytes_.size(); }

 private:
  std::optional<HttpRequest> refuse(int status, std::string sentence);
  bool take_head(std::string_view head);

  HttpBounds bounds_;
  std::string bytes_;
  std::optional<HttpRequest> head_;  // of a request whose body is still to come
  std::size_t body_size_ = 0;
  std::optional<HttpRefusal> refusal_;
};

}  // namespace nido
