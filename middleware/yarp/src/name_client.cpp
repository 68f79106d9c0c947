#include "name_client.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include "nido/yarp/names.h"

namespace nido::yarp {
namespace {

constexpr auto kPatience = std::chrono::seconds(3);
constexpr std::size_t kLongestAnswer = 4 << 20;
constexpr std::size_t kMostWaiting = 100'000;

}  // namespace

void NameClient::ask(const std::string& request, Done done) {
  if (waiting_.size() >= kMostWaiting) {
    done(Error{ErrorCode::kFailed, "too many questions wait for the name server"});
    return;
  }
  if (waiting_.empty()) last_progress_ = std::chrono::steady_clock::now();
  out_ += "NAME_SERVER " + request + "\n";
  waiting_.push_back(std::move(done));
  if (!fd_.is_open()) connect();
  if (connected_) flush();
}

void NameClient::connect() {
  Result<Fd> fd = connect_tcp(host_, port_);
  if (!fd) return drop(fd.error().message);
  fd_ = std::move(*fd);
  connected_ = false;
  proof_.clear();
  handshake_.reset();
  if (!secret_.empty()) handshake_.emplace(secret_, SecretHandshake::End::kConnects);
  const Status watched =
      loop_.watch(fd_.get(), true, true, [this](EventLoop::Happened what) { happened(what); });
  if (!watched) drop(watched.error().message);
}

void NameClient::happened(EventLoop::Happened what) {
  if (!connected_ && (what.writable || what.broken)) {
    if (const Status outcome = connect_outcome(fd_.get()); !outcome) return drop(outcome.error().message);
    connected_ = true;
  }
  if (what.writable) flush();
  if (!fd_.is_open() || (!what.readable && !what.broken)) return;
  char bytes[16 * 1024];
  const ssize_t count = recv(fd_.get(), bytes, sizeof bytes, 0);
  if (count == 0 || (count < 0 && errno != EAGAIN)) return drop("the name server closed the connection");
  if (count < 0) return;
  last_progress_ = std::chrono::steady_clock::now();
  in_.append(bytes, static_cast<std::size_t>(count));
  if (handshake_) {
    if (const Status shown = handshake_->feed(in_, proof_); !shown) return drop(shown.error().message);
    if (handshake_->is_done()) handshake_.reset();
    flush();
    if (!fd_.is_open()) return;
  }
  if (handshake_) return;
  for (std::size_t end = in_.find('\n'); end != std::string::npos; end = in_.find('\n')) {
    std::string line = in_.substr(0, end);
    in_.erase(0, end + 1);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (!line.starts_with(kEndOfAnswer)) {
      lines_.push_back(std::move(line));
      continue;
    }
    if (waiting_.empty()) continue;
    const Done done = std::move(waiting_.front());
    waiting_.pop_front();
    done(std::exchange(lines_, {}));
    if (!fd_.is_open()) return;
  }
  if (in_.size() > kLongestAnswer || lines_.size() > kMostWaiting)
    drop("the name server's answer does not end");
}

bool NameClient::send_from(std::string& bytes) {
  while (!bytes.empty()) {
    const ssize_t count = send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count < 0) {
      if (errno == EAGAIN) break;
      drop("the name server closed the connection");
      return false;
    }
    bytes.erase(0, static_cast<std::size_t>(count));
  }
  return true;
}

void NameClient::flush() {
  if (!send_from(proof_)) return;
  // what is asked comes after the handshake
  if (!handshake_ && proof_.empty() && !send_from(out_)) return;
  loop_.change(fd_.get(), true, !proof_.empty() || (!handshake_ && !out_.empty()));
}

void NameClient::look_at_clock() {
  if (!waiting_.empty() && std::chrono::steady_clock::now() - last_progress_ > kPatience) {
    drop("the name server does not answer");
  }
}

void NameClient::drop(const std::string& reason) {
  if (fd_.is_open()) loop_.unwatch(fd_.get());
  fd_.reset();
  connected_ = false;
  out_.clear();
  in_.clear();
  lines_.clear();
  std::deque<Done> waiting;
  waiting.swap(waiting_);
  for (const Done& done : waiting) {
    done(Error{ErrorCode::kNotFound, fmt::format("name server {}:{}: {}", host_, port_, reason)});
  }
}

}  // namespace nido::yarp
