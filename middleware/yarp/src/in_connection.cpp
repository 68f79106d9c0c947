#include <fmt/format.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "connections.h"

namespace nido::yarp {
namespace {

constexpr std::size_t kReadBytes = 64 * 1024;
// replies that a client leaves unread; it is not listened to meanwhile
constexpr std::size_t kMostUnsent = 256 * 1024;

}  // namespace

InConnection::InConnection(std::uint64_t its_id, EventLoop& loop, ConnectionOwner& owner, Fd fd,
                           std::string its_peer, const StreamLimits& limits, std::size_t queue,
                           SteadyTime deadline, const std::string& secret)
    : id(its_id),
      peer(std::move(its_peer)),
      stream(limits),
      loop_(loop),
      owner_(owner),
      fd_(std::move(fd)),
      has_secret_(!secret.empty()),
      deadline_(deadline),
      queue_(queue),
      held_(owner.held_total()) {
  if (has_secret_) handshake_.emplace(secret, SecretHandshake::End::kAccepts);
}

InConnection::~InConnection() {
  if (fd_.is_open()) loop_.unwatch(fd_.get());
}

bool InConnection::start() {
  if (!loop_.watch(fd_.get(), true, false, [this](EventLoop::Happened what) { happened(what); }))
    return false;
  if (handshake_) send(handshake_->begin());
  return !ended_;
}

bool InConnection::is_proven(std::string& bytes) {
  if (!handshake_) return true;
  handshake_bytes_ += bytes;
  std::string out;
  const Status fed = handshake_->feed(handshake_bytes_, out);
  if (!fed) {
    busy_ = true;
    owner_.on_event(id, Refused{fed.error().message, {}});
    return false;
  }
  send(out);
  if (ended_ || !handshake_->is_done()) return false;
  handshake_.reset();
  bytes = std::move(handshake_bytes_);
  handshake_bytes_.clear();
  return true;
}

void InConnection::end(const std::string& reason) {
  if (ended_) return;
  ended_ = true;
  token_.reset();
  if (fd_.is_open()) loop_.unwatch(fd_.get());
  fd_.reset();
  owner_.on_end(id, reason);
}

void InConnection::happened(EventLoop::Happened what) {
  if (what.writable) flush();
  if (ended_) return;
  if (what.readable || what.broken) {
    if (datagrams_) {
      read_datagrams();
    } else {
      read_stream();
    }
  }
}

void InConnection::read_stream() {
  char bytes[kReadBytes];
  for (int rounds = 0; rounds < 8; ++rounds) {
    if (!stream.hungry() && !is_reversed && !finishing_) break;
    const ssize_t count = recv(fd_.get(), bytes, sizeof bytes, 0);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) break;
    if (count <= 0) {
      // what came before it closed is still worked on
      far_end_closed_ = true;
      if (!busy_ || count < 0) return end("closed by the far side");
      loop_.unwatch(fd_.get());
      return;
    }
    // who reads now has nothing to say any more, and who is being dismissed neither
    if (is_reversed || finishing_) continue;
    if (handshake_) {
      std::string got(bytes, static_cast<std::size_t>(count));
      if (is_proven(got)) stream.feed(got);
      if (ended_) return;
    } else {
      stream.feed(std::string_view(bytes, static_cast<std::size_t>(count)));
    }
    handle_events();
    if (ended_ || datagrams_) return;
    if (static_cast<std::size_t>(count) < sizeof bytes) break;
  }
  watch_again();
}

void InConnection::read_datagrams() {
  char bytes[kReadBytes];
  for (int rounds = 0; rounds < 64; ++rounds) {
    if (!stream.hungry()) break;
    const ssize_t count = recv(fd_.get(), bytes, sizeof bytes, 0);
    if (count < 0) break;
    const auto piece = datagrams_->take(std::string_view(bytes, static_cast<std::size_t>(count)));
    if (!piece) continue;
    if (piece->restarts) stream.restart_message();
    stream.feed(piece->bytes);
    handle_events();
    if (ended_) return;
  }
  watch_again();
}

void InConnection::handle_events() {
  if (handling_) return;
  handling_ = true;
  while (!busy_ && !ended_ && !is_reversed && !finishing_ && out_.left() < kMostUnsent) {
    std::optional<Event> event = stream.next();
    if (!event) break;
    busy_ = true;
    owner_.on_event(id, std::move(*event));
  }
  handling_ = false;
  if (!ended_ && far_end_closed_ && !busy_) end("closed by the far side");
}

void InConnection::accept(const std::string& its_sender, int own_port, const std::string& host) {
  opened_ = true;
  sender = its_sender;
  if (stream.carrier() != Carrier::kUdp) return answer(stream.welcome(its_sender, own_port));
  // anybody can send datagrams: they show no secret
  if (has_secret_) return finish({});
  // datagrams come on a socket of their own; the first one has no more to say
  Result<Fd> datagrams = open_udp(host, 0, {}, 0);
  if (!datagrams) return finish({});
  send(stream.welcome(its_sender, local_port(datagrams->get())));
  if (ended_) return;
  loop_.unwatch(fd_.get());
  fd_ = std::move(*datagrams);
  out_.clear();
  datagrams_.emplace();
  busy_ = false;
  if (!start()) end("no datagrams can be had");
}

void InConnection::answer(const std::string& bytes) {
  busy_ = false;
  send(bytes);
  if (ended_) return;
  handle_events();
  if (!ended_) watch_again();
}

void InConnection::send(const std::string& bytes) {
  if (bytes.empty() || ended_ || datagrams_) return;
  if (far_end_closed_) {
    // it has no more to say, but may still listen
    [[maybe_unused]] const ssize_t count = ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    return;
  }
  out_.add(bytes);
  flush();
}

void InConnection::finish(const std::string& farewell) {
  finishing_ = true;
  busy_ = false;
  send(farewell);
  if (!ended_ && (out_.is_empty() || far_end_closed_)) end("finished");
}

void InConnection::reverse() {
  is_reversed = true;
  busy_ = false;
  watch_again();
}

void InConnection::give(const std::shared_ptr<const Content>& content, const std::string& envelope) {
  owner_.on_lost(queue_.push({content, envelope}));
  pump();
}

void InConnection::pump() {
  while (!ended_ && !far_end_closed_ && out_.is_empty()) {
    std::optional<SendQueue::Item> item = queue_.pop();
    if (!item) return;
    out_.add(stream.carrier(), std::move(item->content), dialect, item->envelope);
    flush();
  }
}

void InConnection::flush() {
  if (const int failed = out_.send_to(fd_.get()); failed != 0) {
    if (failed == EAGAIN) return watch_again();
    return end(std::strerror(failed));
  }
  if (finishing_) return end("finished");
  if (is_reversed) pump();
  if (ended_) return;
  if (!busy_) handle_events();
  if (!ended_) watch_again();
}

void InConnection::watch_again() {
  if (const std::size_t before = held_.bytes(), now = stream.held_bytes() + out_.held_bytes();
      now != before) {
    held_.set(now);
    if (now > before) owner_.on_held();
  }
  if (!fd_.is_open() || far_end_closed_) return;
  const bool unread = out_.left() >= kMostUnsent;
  loop_.change(fd_.get(), is_reversed || finishing_ || (stream.hungry() && !unread), !out_.is_empty());
}

}  // namespace nido::yarp
