#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nido/yarp/event_loop.h"
#include "nido/yarp/secret_handshake.h"
#include "sockets.h"

namespace nido::yarp {

// Asks a name server that runs elsewhere, one request after the other. For the loop's thread.
class NameClient {
 public:
  // The lines of an answer without the end mark, or why there is none.
  using Done = std::function<void(Result<std::vector<std::string>>)>;

  // `secret`: shown to the name server, which must know it too; empty: none.
  NameClient(EventLoop& loop, std::string host, int port, std::string secret)
      : loop_(loop), host_(std::move(host)), port_(port), secret_(std::move(secret)) {}
  ~NameClient() { drop("this program ends"); }
  NameClient(const NameClient&) = delete;
  NameClient& operator=(const NameClient&) = delete;

  void ask(const std::string& request, Done done);
  // Gives up what has waited too long. To be called now and then.
  void look_at_clock();

 private:
  void connect();
  void happened(EventLoop::Happened what);
  void flush();
  // Sends what it can of `bytes`; false when the connection has gone.
  bool send_from(std::string& bytes);
  void drop(const std::string& reason);

  EventLoop& loop_;
  const std::string host_;
  const int port_;
  const std::string secret_;
  Fd fd_;
  std::optional<SecretHandshake> handshake_;  // while it goes on
  std::string proof_;                         // of it, that is still to be sent
  bool connected_ = false;
  std::string out_;
  std::string in_;
  std::vector<std::string> lines_;
  std::deque<Done> waiting_;
  std::chrono::steady_clock::time_point last_progress_;
};

}  // namespace nido::yarp
