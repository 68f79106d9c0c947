#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

#include "nido/yarp/port_host.h"
#include "nido/yarp/stream.h"

namespace nido::yarp {

// What one connection still has to send: bytes, and behind them the content of one message, which stays where
// it is and may be sent by other connections at the same time.
class Outgoing {
 public:
  [[nodiscard]] bool is_empty() const { return left() == 0; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_ + content_left(); }
  // Memory that this keeps.
  [[nodiscard]] std::size_t held_bytes() const { return bytes_.capacity() + content_left(); }
  void add(const std::string& bytes);
  // A message that wants no reply.
  void add(Carrier carrier, std::shared_ptr<const Content> content, Dialect dialect,
           const std::string& envelope);
  // Sends what the socket takes now. 0, or what errno says: EAGAIN when it takes no more.
  int send_to(int fd);
  void clear();

 private:
  [[nodiscard]] std::size_t content_left() const {
    return content_ ? content_bytes_->size() - content_at_ : 0;
  }

  std::string bytes_;
  std::size_t at_ = 0;  // of bytes_, sent
  std::shared_ptr<const Content> content_;
  const std::string* content_bytes_ = nullptr;  // of content_
  std::size_t content_at_ = 0;                  // of it, sent
};

}  // namespace nido::yarp
