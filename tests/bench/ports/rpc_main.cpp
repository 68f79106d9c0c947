// nido-bench-rpc: a question to a service and its answer, beside bare messages (docs/bench.md).
#include "ping_pong.h"

int main(int argc, char** argv) {
  using namespace nido::bench;
  return ping_pong_main(argc, argv, "rpc", {nido_service(), nido_port(), plain_fast_dds(), unix_socket()});
}
