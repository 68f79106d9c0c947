#include "nido/dashboard/http_request.h"

#include <algorithm>
#include <charconv>
#include <cstdint>

namespace nido {
namespace {

constexpr std::string_view kEnd = "\r\n\r\n";

bool is_token_char(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("!#$%&'*+-.^_`|~").find(c) != std::string_view::npos;
}

bool is_token(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), is_token_char);
}

bool is_printable(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < 0x7f; });
}

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return result;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

int digit_of(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// "%2F" is "/", "+" a blank; nothing if a % is followed by something else.
std::optional<std::string> decoded(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '+') {
      result += ' ';
    } else if (text[i] == '%') {
      const int high = i + 2 < text.size() ? digit_of(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? digit_of(text[i + 2]) : -1;
      if (high < 0 || low < 0) return std::nullopt;
      result += static_cast<char>(high * 16 + low);
      i += 2;
    } else {
      result += text[i];
    }
  }
  return result;
}

// Cuts off what comes before `separator`, or all of it.
std::string_view take_until(std::string_view& rest, std::string_view separator) {
  const std::size_t at = rest.find(separator);
  const std::string_view part = rest.substr(0, at);
  rest = at == std::string_view::npos ? std::string_view() : rest.substr(at + separator.size());
  return part;
}

}  // namespace

std::optional<HttpRequest> HttpParser::refuse(int status, std::string sentence) {
  refusal_ = HttpRefusal{status, std::move(sentence)};
  bytes_.clear();
  head_.reset();
  return std::nullopt;
}

// The request line and the headers; false: refused.
bool HttpParser::take_head(std::string_view head) {
  HttpRequest request;
  std::string_view line = take_until(head, "\r\n");
  const std::string_view method = take_until(line, " ");
  const std::string_view target = take_until(line, " ");
  if (!is_token(method) || target.empty() || !is_printable(target)) {
    refuse(400, "the first line is no request");
    return false;
  }
  if (line != "HTTP/1.1" && line != "HTTP/1.0") {
    refuse(line.starts_with("HTTP/") ? 505 : 400, "HTTP/1.1 is spoken here");
    return false;
  }
  if (target.front() != '/') {
    refuse(400, "the address must begin with a slash");
    return false;
  }
  request.method = method;
  std::string_view query = target;
  request.path = take_until(query, "?");
  while (!query.empty()) {
    std::string_view value = take_until(query, "&");
    const auto key = decoded(take_until(value, "="));
    const auto text = decoded(value);
    if (!key || !text) {
      refuse(400, "the address has a % that no two digits follow");
      return false;
    }
    request.query[*key] = *text;
  }
  while (!head.empty()) {
    std::string_view value = take_until(head, "\r\n");
    const bool has_colon = value.find(':') != std::string_view::npos;
    const std::string_view name = take_until(value, ":");
    const bool has_control = std::any_of(
        value.begin(), value.end(), [](char c) { return (c >= 0 && c < ' ' && c != '\t') || c == 0x7f; });
    if (!has_colon || !is_token(name) || has_control) {
      refuse(400, "a header is malformed");
      return false;
    }
    if (request.headers.size() >= bounds_.headers) {
      refuse(431, "too many headers");
      return false;
    }
    // a second Host or length could be read in two ways
    if (!request.headers.emplace(lower(name), trimmed(value)).second) {
      refuse(400, "a header comes twice");
      return false;
    }
  }
  if (request.headers.contains("transfer-encoding")) {
    refuse(501, "a body needs Content-Length");
    return false;
  }
  body_size_ = 0;
  if (const auto length = request.headers.find("content-length"); length != request.headers.end()) {
    const std::string& text = length->second;
    std::uint64_t size = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), size);
    if (text.empty() || error != std::errc() || end != text.data() + text.size()) {
      refuse(400, "Content-Length is no number");
      return false;
    }
    if (size > bounds_.body_bytes) {
      refuse(413, "the body is too long");
      return false;
    }
    body_size_ = static_cast<std::size_t>(size);
  }
  const auto connection = request.headers.find("connection");
  const std::string wish = connection == request.headers.end() ? "" : lower(connection->second);
  request.keep_alive = line == "HTTP/1.1" ? wish != "close" : wish == "keep-alive";
  head_ = std::move(request);
  return true;
}

std::optional<HttpRequest> HttpParser::next() {
  if (refusal_) return std::nullopt;
  if (!head_) {
    const std::size_t end = bytes_.find(kEnd);
    if (end == std::string::npos ? bytes_.size() > bounds_.head_bytes : end > bounds_.head_bytes) {
      return refuse(431, "the headers are too long");
    }
    // what is no request at all need not be waited for
    if (end == std::string::npos && !bytes_.empty() && !is_token_char(bytes_.front())) {
      return refuse(400, "the first line is no request");
    }
    if (end == std::string::npos) return std::nullopt;
    const std::string head = bytes_.substr(0, end);
    bytes_.erase(0, end + kEnd.size());
    if (!take_head(head)) return std::nullopt;
  }
  if (bytes_.size() < body_size_) return std::nullopt;
  HttpRequest request = std::move(*head_);
  head_.reset();
  request.body = bytes_.substr(0, body_size_);
  bytes_.erase(0, body_size_);
  return request;
}

}  // namespace nido
