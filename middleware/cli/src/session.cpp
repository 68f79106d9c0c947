#include "session.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>

#include "nido/launcher/suggest.h"
#include "nido/launcher/terminal.h"
#include "nido/middleware/port_name.h"

namespace nido::cli {
namespace {

// The one thing that a signal handler may touch.
std::atomic<bool> stop_asked{false};

extern "C" void on_signal(int) {
  if (stop_asked.exchange(true)) _exit(130);
}

std::string fingerprint(const Directory& directory) {
  std::string text;
  for (const auto& node : directory.nodes()) {
    text += node.name + node.state + std::to_string(node.ports.size()) + ";";
  }
  return text + std::to_string(directory.topics().size());
}

}  // namespace

bool interrupted() { return stop_asked; }

Result<Session> join(const Common& common) {
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  NodeOptions options;
  options.name = fmt::format("nido_{}", getpid());
  options.domain = common.domain;
  options.handle_signals = false;
  options.hidden = true;
  auto node = Node::create(options);
  if (!node) return node.error();
  Session session;
  session.node = std::move(*node);
  auto directory = Directory::open(*session.node);
  if (!directory) return directory.error();
  session.directory = std::move(*directory);
  return session;
}

void settle(Directory& directory) {
  using SteadyClock = std::chrono::steady_clock;
  const auto start = SteadyClock::now();
  const auto at_least = start + std::chrono::milliseconds(600);
  const auto at_most = start + std::chrono::milliseconds(2000);
  std::string before = fingerprint(directory);
  while (!interrupted() && SteadyClock::now() < at_most) {
    const bool changed =
        directory.wait([&before](const Directory& d) { return fingerprint(d) != before; }, 0.3);
    if (!changed && SteadyClock::now() >= at_least) return;
    before = fingerprint(directory);
  }
}

int fail(const Error& error) {
  fmt::print(stderr, "error: {}\n", error.message);
  return exit_code_of(error);
}

Result<Directory::Owner> find_port(const Session& session, const Common& common, const std::string& port) {
  if (auto status = check_port_name(port); !status) return status.error();
  session.directory->wait(
      [&port](const Directory& d) { return interrupted() || d.owner_of(port).has_value(); }, common.wait_s);
  if (auto owner = session.directory->owner_of(port)) return *owner;
  if (interrupted()) return Error{ErrorCode::kInterrupted, "stopped"};
  std::vector<std::string> names;
  for (const auto& node : session.directory->nodes()) {
    for (const auto& one : node.ports) names.push_back(one.name);
  }
  const std::string near = nearest_word(port, names);
  return Error{
      ErrorCode::kNotFound,
      fmt::format("there is no port {} in domain {}{}", port, common.domain,
                  names.empty()
                      ? ": no node is running there (start one with nido launch, or name another domain "
                        "with --domain)"
                  : near.empty() ? "; nido port list shows those that there are"
                                 : fmt::format("; did you mean {}?", near))};
}

Result<Source> find_source(const Session& session, const Common& common, const std::string& port) {
  if (auto status = check_port_name(port); !status) return status.error();
  if (port.ends_with(":i")) {
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("{} is an input port: read the output that feeds it (nido port info {})", port, port)};
  }
  const std::string topic = topic_of(port);
  const auto topic_there = [&topic](const Directory& d) -> std::optional<TopicDescription> {
    for (const auto& one : d.topics()) {
      if (one.topic == topic && one.writers > 0) return one;
    }
    return std::nullopt;
  };
  session.directory->wait(
      [&](const Directory& d) {
        return interrupted() || d.owner_of(port).has_value() || topic_there(d).has_value();
      },
      common.wait_s);
  // a topic is seen before the node that announces it: give that a moment
  session.directory->wait([&](const Directory& d) { return interrupted() || d.owner_of(port).has_value(); },
                          0.3);
  Source source;
  std::string type_name;
  if (const auto owner = session.directory->owner_of(port)) {
    if (owner->port.direction == "service") {
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("{} is a service: ask it with nido port rpc {} TEXT", port, port)};
    }
    type_name = owner->port.type;
    if (auto profile = profile_from_string(owner->port.profile)) source.profile = *profile;
  } else if (const auto there = topic_there(*session.directory)) {
    type_name = there->type;
  } else {
    return find_port(session, {common.domain, common.json, 0.0}, port).error();
  }
  source.type = find_any_type(type_name);
  if (source.type == nullptr) {
    return Error{ErrorCode::kUnsupported,
                 fmt::format("{} carries {}, a type that this nido does not know", port, type_name)};
  }
  return source;
}

}  // namespace nido::cli
