// nido-replayer: a process of an app that says again what a recording holds, in the ticks in which it was
// said (config/apps/continue.yaml). Parameters: file; ports, a list of names, * and ? allowed; period_s of
// the ticks.
#include <iostream>
#include <string>
#include <vector>

#include "nido/middleware/node.h"
#include "nido/recorder/replayer.h"

namespace {

using namespace nido;

Status replay(Node& node) {
  const auto file = node.parameter<std::string>("file", "");
  const auto ports = node.parameter<std::vector<std::string>>("ports", {});
  if (!file) return file.error();
  if (!ports) return ports.error();
  if (node.options().clock != ClockMode::kLockstep) {
    return Error{ErrorCode::kInvalidArgument,
                 "what was recorded in ticks is replayed in ticks: run the app in lockstep"};
  }
  auto reader = mcap::Reader::open(*file);
  if (!reader) return reader.error();
  NodeOptions hidden;
  hidden.name = node.options().name + "_side";
  hidden.domain = node.options().domain;
  hidden.handle_signals = false;
  hidden.hidden = true;
  auto side = Node::create(hidden);
  if (!side) return side.error();
  ReplayOptions options;
  options.ports = *ports;
  auto replayer = Replayer::open(node, **side, std::move(*reader), std::move(options));
  if (!replayer) return replayer.error();
  node.set_ready();
  const std::int64_t period_ns = Time::from_seconds(node.options().period_s).ns;
  return node.run([&](Time now) { return (*replayer)->take_tick(now, Time{now.ns + period_ns}); });
}

}  // namespace

int main(int argc, char** argv) { return nido::node_main(argc, argv, "replayer", replay); }
