#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "nido/interfaces/result.h"
#include "nido/yarp/stream.h"

namespace nido::bench {

// A connection of a minimal YARP program: blocking, one thread. The same for all that are measured.
class YarpLine {
 public:
  // Looks a port up at the name server on this number and connects to it.
  static Result<YarpLine> open(int names_port, const std::string& port, yarp::Carrier carrier);
  YarpLine(YarpLine&& other) noexcept;
  YarpLine& operator=(YarpLine&&) = delete;
  ~YarpLine();

  // Sends one message over carrier tcp and waits for the reply and its acknowledgement; false when it ends.
  bool ask(std::string_view framed);
  // Begins to read what the port gives.
  bool reverse();
  // Takes one message of what the port gives; its bytes, 0 when it ends or nothing came for two seconds.
  std::size_t take();

 private:
  explicit YarpLine(int fd) : fd_(fd) {}
  bool send(std::string_view bytes) const;
  bool fill(std::size_t bytes);

  int fd_ = -1;
  std::string buffer_;
  std::size_t used_ = 0;  // of the buffer
};

}  // namespace nido::bench
