#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido::bench {

constexpr std::size_t kMessage_bytes = 64;

// The asking side of a round trip: a message of 64 bytes there and back.
class PingPong {
 public:
  virtual ~PingPong() = default;
  // For the answering process, which is started after this object was made.
  [[nodiscard]] virtual std::string address() const { return ""; }
  // Waits until the other side is there.
  virtual Status connect() = 0;
  // False when nothing came back within a second.
  virtual bool round_trip() = 0;
};

// One way to make a round trip between two processes.
struct PingPongKind {
  std::string who;
  std::string metric;  // "rtt", "rpc"
  std::string absent;  // why this build does not have it
  // Error kUnsupported: this machine does not have it, the others go on without it.
  std::function<Result<std::unique_ptr<PingPong>>(int domain)> ask;
  // Answers until the parent process closes its end.
  std::function<Status(int domain, const std::string& address)> answer;
};

PingPongKind nido_port();
PingPongKind nido_service();
PingPongKind plain_fast_dds();
PingPongKind cyclone_dds();
PingPongKind zeromq_tcp();
PingPongKind ros_1();
PingPongKind ignition_transport();
// Ports of YARP, by each of its carriers between processes of one machine.
std::vector<PingPongKind> yarp_carriers();
PingPongKind unix_socket();

// Measures these against each other, in turns; both processes' `main`. Ratios are printed of the first kind
// to each other one.
int ping_pong_main(int argc, char** argv, const std::string& bench, const std::vector<PingPongKind>& kinds);

}  // namespace nido::bench
