// nido-dashboard: a page on which a person watches and drives a system. docs/dashboard.md
#include "nido/dashboard/dashboard.h"
#include "nido/middleware/node.h"

namespace {

using namespace nido;

Status run(Node& node) {
  const auto port = node.parameter<int>("port", 8080);
  const auto story = node.parameter<std::string>("story", "");
  if (!port) return port.error();
  if (!story) return story.error();
  if (*port < 0 || *port > 65'535) {
    return Error{ErrorCode::kInvalidArgument,
                 "port is " + std::to_string(*port) + ": 0 (a free one) to 65535"};
  }
  auto dashboard = Dashboard::open(node, {*port, *story});
  if (!dashboard) return dashboard.error();
  node.log_info("look at " + (*dashboard)->address());
  node.set_ready();
  const Status ended = node.run([&dashboard](Time) {
    (*dashboard)->tick();
    return Status();
  });
  // asked to stop is what it ends with
  if (!ended && ended.error().code == ErrorCode::kInterrupted) return {};
  return ended;
}

}  // namespace

int main(int argc, char** argv) { return nido::node_main(argc, argv, "dashboard", run); }
