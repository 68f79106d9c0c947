#include <fmt/format.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "connections.h"

namespace nido::yarp {
namespace {

constexpr int kMostRefusedDatagrams = 5;

}  // namespace

OutConnection::OutConnection(std::uint64_t its_id, EventLoop& loop, ConnectionOwner& owner,
                             std::string its_port, Contact its_target, Carrier its_carrier, std::size_t queue,
                             Dialect dialect, SteadyTime deadline, const std::string& secret)
    : id(its_id),
      port(std::move(its_port)),
      target(std::move(its_target)),
      carrier(its_carrier),
      loop_(loop),
      owner_(owner),
      answers_(its_carrier),
      dialect_(dialect),
      deadline_(deadline),
      queue_(queue),
      held_(owner.held_total()) {
  if (!secret.empty()) handshake_.emplace(secret, SecretHandshake::End::kConnects);
}

OutConnection::~OutConnection() {
  if (fd_.is_open()) loop_.unwatch(fd_.get());
}

void OutConnection::start(std::function<void(Status)> done) {
  done_ = std::move(done);
  Result<Fd> fd = connect_tcp(target.host, target.port);
  if (!fd) return end(fd.error().message);
  fd_ = std::move(*fd);
  const Status watched =
      loop_.watch(fd_.get(), true, true, [this](EventLoop::Happened what) { happened(what); });
  if (!watched) end(watched.error().message);
}

void OutConnection::end(const std::string& reason) {
  if (state_ == State::kEnded) return;
  if (state_ == State::kReady && fd_.is_open()) {
    // a last word, if there is room for it: who reads knows then that this was on purpose
    const std::string last = goodbye(carrier);
    if (carrier == Carrier::kUdp) {
      send_datagrams(last);
    } else if (out_.is_empty()) {
      [[maybe_unused]] const ssize_t count = send(fd_.get(), last.data(), last.size(), MSG_NOSIGNAL);
    }
  }
  state_ = State::kEnded;
  if (fd_.is_open()) loop_.unwatch(fd_.get());
  fd_.reset();
  if (done_) std::exchange(done_, nullptr)(Error{ErrorCode::kNotFound, reason});
  owner_.on_end(id, reason);
}

void OutConnection::happened(EventLoop::Happened what) {
  if (state_ == State::kConnecting && (what.writable || what.broken)) {
    if (const Status outcome = connect_outcome(fd_.get()); !outcome) return end(outcome.error().message);
    state_ = handshake_ ? State::kProving : State::kGreeting;
    if (!handshake_) out_.add(greeting(carrier, port));
    flush();
  } else if (what.writable) {
    flush();
  }
  if (state_ != State::kEnded && (what.readable || what.broken)) read();
}

void OutConnection::prove(std::string_view bytes) {
  handshake_bytes_ += bytes;
  std::string out;
  if (const Status fed = handshake_->feed(handshake_bytes_, out); !fed) return end(fed.error().message);
  out_.add(out);
  if (handshake_->is_done()) {
    state_ = State::kGreeting;
    out_.add(greeting(carrier, port));
    handshake_.reset();
  }
  flush();
}

void OutConnection::read() {
  char bytes[4096];
  const ssize_t count = recv(fd_.get(), bytes, sizeof bytes, 0);
  if (count < 0) {
    if (errno == EAGAIN || errno == EINTR) return;
    // a datagram found nobody: perhaps nobody yet
    if (carrier == Carrier::kUdp && state_ == State::kReady && ++refused_datagrams_ < kMostRefusedDatagrams)
      return;
    return end(std::strerror(errno));
  }
  if (count == 0) {
    if (carrier == Carrier::kUdp && state_ == State::kReady) return;
    return end("closed by the far side");
  }
  if (carrier == Carrier::kUdp && state_ == State::kReady) return;
  if (state_ == State::kProving) return prove(std::string_view(bytes, static_cast<std::size_t>(count)));
  answers_.feed(std::string_view(bytes, static_cast<std::size_t>(count)));
  if (state_ == State::kGreeting) {
    const Result<std::optional<std::int32_t>> number = answers_.welcome();
    if (!number) return end(number.error().message);
    if (*number) on_welcome(**number);
    if (state_ != State::kReady) return;
  }
  if (!has_ack(carrier)) {
    // nothing is expected: whatever comes is of no interest
    answers_ = AnswerReader(carrier);
    return;
  }
  while (awaits_ack_) {
    const Result<bool> acknowledged = answers_.ack();
    if (!acknowledged) return end(acknowledged.error().message);
    if (!*acknowledged) break;
    awaits_ack_ = false;
    pump();
    if (state_ == State::kEnded) return;
  }
  constexpr std::size_t kMostUnexpected = 64 * 1024;
  if (answers_.buffered() > kMostUnexpected) end("the far side sends what nobody asked for");
}

void OutConnection::on_welcome(int number) {
  if (carrier == Carrier::kUdp) {
    loop_.unwatch(fd_.get());
    fd_.reset();
    Result<Fd> datagrams = number > 0 && number < 65'536
                               ? open_udp("127.0.0.1", 0, target.host, number)
                               : Result<Fd>(Error{ErrorCode::kFailed, "no port for datagrams was given"});
    if (!datagrams) return end(datagrams.error().message);
    fd_ = std::move(*datagrams);
    const Status watched =
        loop_.watch(fd_.get(), true, false, [this](EventLoop::Happened what) { happened(what); });
    if (!watched) return end(watched.error().message);
  }
  state_ = State::kReady;
  if (done_) std::exchange(done_, nullptr)(Status());
  pump();
}

void OutConnection::give(const std::shared_ptr<const Content>& content, const std::string& envelope) {
  if (state_ == State::kEnded) return;
  owner_.on_lost(queue_.push({content, envelope}));
  pump();
}

void OutConnection::pump() {
  while (state_ == State::kReady && !awaits_ack_ && out_.is_empty()) {
    std::optional<SendQueue::Item> item = queue_.pop();
    if (!item) return;
    if (carrier == Carrier::kUdp) {
      send_datagrams(message(carrier, item->content->bytes(dialect_), item->envelope, false));
      continue;
    }
    out_.add(carrier, std::move(item->content), dialect_, item->envelope);
    held_.set(out_.held_bytes());
    owner_.on_held();
    awaits_ack_ = has_ack(carrier);
    flush();
  }
}

void OutConnection::send_datagrams(const std::string& framed) {
  for (const std::string& datagram : to_datagrams(framed)) {
    if (::send(fd_.get(), datagram.data(), datagram.size(), MSG_NOSIGNAL) >= 0) {
      refused_datagrams_ = 0;
    } else if (errno == ECONNREFUSED && ++refused_datagrams_ >= kMostRefusedDatagrams &&
               state_ == State::kReady) {
      // not now: who calls this is still at work on this connection
      loop_.change(fd_.get(), true, true);
      return;
    }
  }
}

void OutConnection::flush() {
  if (carrier == Carrier::kUdp && state_ == State::kReady) {
    loop_.change(fd_.get(), true, false);
    if (refused_datagrams_ >= kMostRefusedDatagrams) end("nobody takes the datagrams");
    return;
  }
  if (const int failed = out_.send_to(fd_.get()); failed != 0) {
    if (failed != EAGAIN) return end(std::strerror(failed));
    loop_.change(fd_.get(), true, true);
    return;
  }
  held_.set(out_.held_bytes());
  loop_.change(fd_.get(), true, false);
  // the text carrier without acknowledgements does not wait for a welcome
  if (state_ == State::kGreeting && carrier == Carrier::kText) {
    state_ = State::kReady;
    if (done_) std::exchange(done_, nullptr)(Status());
  }
  if (state_ == State::kReady) pump();
}

}  // namespace nido::yarp
