// nido-bench-rtt: a message through a port and one back, and the same by others (docs/bench.md).
#include "ping_pong.h"

int main(int argc, char** argv) {
  using namespace nido::bench;
  std::vector<PingPongKind> kinds = {nido_port(), plain_fast_dds(),     cyclone_dds(),
                                     ros_1(),     ignition_transport(), zeromq_tcp()};
  for (const PingPongKind& kind : yarp_carriers()) kinds.push_back(kind);
  kinds.push_back(unix_socket());
  return ping_pong_main(argc, argv, "rtt", kinds);
}
