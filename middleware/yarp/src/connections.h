#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "held.h"
#include "nido/yarp/event_loop.h"
#include "nido/yarp/port_host.h"
#include "nido/yarp/secret_handshake.h"
#include "nido/yarp/stream.h"
#include "outgoing.h"
#include "sockets.h"

namespace nido::yarp {

using SteadyTime = std::chrono::steady_clock::time_point;

// Messages that wait for one connection: a bounded number, the oldest go.
class SendQueue {
 public:
  explicit SendQueue(std::size_t most) : most_(most) {}
  struct Item {
    std::shared_ptr<const Content> content;
    std::string envelope;
  };
  // How many had to go.
  std::size_t push(Item item) {
    std::size_t gone = 0;
    for (; items_.size() >= most_; ++gone) items_.pop_front();
    items_.push_back(std::move(item));
    return gone;
  }
  std::optional<Item> pop() {
    if (items_.empty()) return std::nullopt;
    Item item = std::move(items_.front());
    items_.pop_front();
    return item;
  }

 private:
  std::size_t most_;
  std::deque<Item> items_;
};

// What a connection needs of the host it belongs to. Connections end by telling it: it deletes them.
class ConnectionOwner {
 public:
  virtual ~ConnectionOwner() = default;
  // What has come on a connection to a port. The connection is `busy` until answer_to() is called.
  virtual void on_event(std::uint64_t connection, Event event) = 0;
  virtual void on_end(std::uint64_t connection, const std::string& reason) = 0;
  virtual void on_lost(std::size_t messages) = 0;
  // A connection keeps more than before.
  virtual void on_held() = 0;
  [[nodiscard]] virtual HeldTotal held_total() const = 0;
};

// A connection that somebody made to a port of ours.
class InConnection {
 public:
  InConnection(std::uint64_t id, EventLoop& loop, ConnectionOwner& owner, Fd fd, std::string peer,
               const StreamLimits& limits, std::size_t queue, SteadyTime deadline, const std::string& secret);
  ~InConnection();

  // Begins to listen; false when it cannot.
  bool start();

  // After Opened: greets and goes on. Datagrams come on another socket from now on.
  void accept(const std::string& sender, int own_port, const std::string& host);
  // Goes on after an event, with what is to be sent back.
  void answer(const std::string& bytes);
  void send(const std::string& bytes);
  // Sends what there is to send, then ends.
  void finish(const std::string& farewell);
  // Ends at once.
  void hang_up(const std::string& reason) { end(reason); }
  // It has said what it wants.
  void mark_opened() { opened_ = true; }
  // The far side reads from now on.
  void reverse();
  void give(const std::shared_ptr<const Content>& content, const std::string& envelope);

  [[nodiscard]] bool is_late(SteadyTime now) const { return !opened_ && now > deadline_; }
  [[nodiscard]] bool is_opened() const { return opened_; }
  [[nodiscard]] std::size_t held_bytes() const { return held_.bytes(); }
  // It has ended: what it kept counts no more.
  void let_go() { held_.set(0); }
  // Expires when this ends.
  [[nodiscard]] std::weak_ptr<const void> token() const { return token_; }

  const std::uint64_t id;
  const std::string peer;
  std::string port;    // name of the port of ours
  std::string sender;  // who connected
  Dialect dialect = Dialect::k3;
  bool is_reversed = false;
  ReceivingStream stream;

 private:
  void happened(EventLoop::Happened what);
  void read_stream();
  // whether the far end has shown that it knows the secret, if there is one; what it said after that
  bool is_proven(std::string& bytes);
  void read_datagrams();
  void handle_events();
  void flush();
  void pump();
  void watch_again();
  void end(const std::string& reason);

  EventLoop& loop_;
  ConnectionOwner& owner_;
  Fd fd_;
  std::optional<SecretHandshake> handshake_;  // until it is done
  std::string handshake_bytes_;
  const bool has_secret_;
  std::optional<DatagramReader> datagrams_;
  SteadyTime deadline_;
  Outgoing out_;
  SendQueue queue_;
  Held held_;
  std::shared_ptr<const void> token_ = std::make_shared<int>(0);
  bool opened_ = false;
  bool busy_ = false;  // an event is being worked on
  bool handling_ = false;
  bool finishing_ = false;
  bool ended_ = false;
  bool far_end_closed_ = false;
};

// A connection from an output of ours to a port of somebody.
class OutConnection {
 public:
  OutConnection(std::uint64_t id, EventLoop& loop, ConnectionOwner& owner, std::string port, Contact target,
                Carrier carrier, std::size_t queue, Dialect dialect, SteadyTime deadline,
                const std::string& secret);
  ~OutConnection();

  // Begins to connect. `done` is called once, with the outcome.
  void start(std::function<void(Status)> done);
  void give(const std::shared_ptr<const Content>& content, const std::string& envelope);
  [[nodiscard]] bool is_late(SteadyTime now) const { return state_ != State::kReady && now > deadline_; }
  [[nodiscard]] bool is_ready() const { return state_ == State::kReady; }
  [[nodiscard]] std::size_t held_bytes() const { return held_.bytes(); }
  // It has ended: what it kept counts no more.
  void let_go() { held_.set(0); }
  void end(const std::string& reason);

  const std::uint64_t id;
  const std::string port;
  const Contact target;
  const Carrier carrier;

 private:
  enum class State { kConnecting, kProving, kGreeting, kReady, kEnded };
  void happened(EventLoop::Happened what);
  void read();
  void prove(std::string_view bytes);
  void on_welcome(int number);
  void flush();
  void pump();
  void send_datagrams(const std::string& message);

  EventLoop& loop_;
  ConnectionOwner& owner_;
  Fd fd_;
  State state_ = State::kConnecting;
  std::optional<SecretHandshake> handshake_;
  std::string handshake_bytes_;
  AnswerReader answers_;
  const Dialect dialect_;
  SteadyTime deadline_;
  std::function<void(Status)> done_;
  SendQueue queue_;
  Held held_;
  Outgoing out_;
  bool awaits_ack_ = false;
  int refused_datagrams_ = 0;
};

}  // namespace nido::yarp
