// nido-gateway: the ports of a nido system for YARP's programs and for people with telnet. docs/yarp.md

#include <sys/resource.h>

#include <thread>

#include "nido/gateway/gateway.h"

namespace nido::gateway {
namespace {

// as many descriptors as this process may have: each connection takes one
void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

Status run(Node& node) {
  raise_descriptor_limit();
  Result<GatewayOptions> options = gateway_options(node);
  if (!options) return options.error();
  Result<std::unique_ptr<yarp::EventLoop>> loop = yarp::EventLoop::create();
  if (!loop) return loop.error();
  Result<std::unique_ptr<Gateway>> gateway = Gateway::open(node, **loop, std::move(*options));
  if (!gateway) return gateway.error();
  std::thread sockets([&loop] { (*loop)->run(); });
  node.set_ready();
  const Status ended = node.run([](Time) { return Status(); });
  (*loop)->stop();
  sockets.join();
  // asked to stop is what a gateway ends with
  if (!ended && ended.error().code == ErrorCode::kInterrupted) return {};
  return ended;
}

}  // namespace
}  // namespace nido::gateway

int main(int argc, char** argv) { return nido::node_main(argc, argv, "gateway", nido::gateway::run); }
