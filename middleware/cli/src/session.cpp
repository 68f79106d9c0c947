#include "session.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>

#include "nido/cli/idl_type.h"
#include "nido/launcher/suggest.h"
#include "nido/launcher/terminal.h"
#include "nido/middleware/port_name.h"
#include "nido/recorder/idl_text.h"
#include "nido/recorder/raw_message.h"

namespace nido::cli {
namespace {

// All that a signal handler may touch.
std::atomic<bool> stop_asked{false};
std::atomic<bool> ends_soon{false};

extern "C" void on_signal(int number) {
  if (stop_asked.exchange(true) || number == SIGALRM) _exit(130);
  if (ends_soon) alarm(1);
}

std::string fingerprint(const Directory& directory) {
  std::string text;
  for (const auto& node : directory.nodes()) {
    text += node.name + node.state + std::to_string(node.ports.size()) + ";";
  }
  return text + std::to_string(directory.topics().size());
}

// A type that was not there when this was built: messages are shown as they travelled, in hexadecimal digits.
std::shared_ptr<const AnyType> type_of_bytes(const std::string& name) {
  auto any = std::make_shared<AnyType>();
  any->name = name;
  any->type = raw_message_type(name);
  any->to_json = [name](const void* message, std::size_t longest) {
    const auto bytes = static_cast<const RawMessage*>(message)->bytes();
    // a line of a terminal, or all
    const std::size_t shown = longest > 0 ? std::min<std::size_t>(bytes.size(), 32) : bytes.size();
    std::string digits;
    for (std::size_t i = 0; i < shown; ++i)
      digits += fmt::format("{:02x}", static_cast<unsigned char>(bytes[i]));
    return Json{
        {"type", name}, {"length", bytes.size()}, {"cdr", digits + (shown < bytes.size() ? "..." : "")}};
  };
  any->from_json = [name](const Json&, void*) -> Status {
    return Error{ErrorCode::kUnsupported,
                 name + " is a type that this nido does not know: it can only be read"};
  };
  any->wire_size = [](void* message) { return static_cast<const RawMessage*>(message)->bytes().size(); };
  return any;
}

}  // namespace

bool interrupted() { return stop_asked; }

Result<std::shared_ptr<const AnyType>> type_named(const Session& session, const Common& common,
                                                  const std::string& port, const std::string& name) {
  if (const AnyType* known = find_any_type(name)) {
    // never deleted: it belongs to the table of all types
    return std::shared_ptr<const AnyType>(std::shared_ptr<void>(), known);
  }
  IdlTypes types;
  // what other definitions are made of
  for (const AnyType& one : any_types()) (void)types.add(idl_text_of(one.name));
  for (const std::string& file : common.idl) {
    std::ifstream in(file);
    if (!in) return Error{ErrorCode::kNotFound, fmt::format("cannot read {} (--idl)", file)};
    const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    if (Status added = types.add(text); !added) {
      return Error{ErrorCode::kInvalidArgument, fmt::format("{}: {}", file, added.error().message)};
    }
  }
  if (auto type = types.find(name)) return type;
  // the node was built with it
  if (const auto owner = session.directory->owner_of(port)) {
    const auto answer = session.node->call("/" + owner->node.name + "/control", "idl " + port, common.wait_s);
    if (answer && answer->starts_with("[ok]\n") && types.add(answer->substr(5)).ok()) {
      return types.find(name);
    }
  }
  return std::shared_ptr<const AnyType>();
}

namespace {

constexpr std::array<int, 3> kSignals = {SIGINT, SIGTERM, SIGALRM};

// As long as it exists, signals wait for this thread, and threads that are started never get any: they are
// not interrupted in their work.
class SignalsWait {
 public:
  SignalsWait() {
    sigset_t mask;
    sigemptyset(&mask);
    for (const int number : kSignals) sigaddset(&mask, number);
    pthread_sigmask(SIG_BLOCK, &mask, &before_);
  }
  ~SignalsWait() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsWait(const SignalsWait&) = delete;
  SignalsWait& operator=(const SignalsWait&) = delete;

 private:
  sigset_t before_{};
};

}  // namespace

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  for (const int number : kSignals) sigaction(number, &action, nullptr);
}

Result<Session> join(const Common& common, Ending ending) {
  catch_signals();
  const SignalsWait until_it_is_there;
  ends_soon = ending == Ending::kSoon;
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

int fail(const Common& common, const Error& error) { return print_error(error, common.json); }

Result<NodeDescription> find_node(const Session& session, const Common& common, const std::string& name) {
  session.directory->wait([&name](const Directory& d) { return interrupted() || d.node(name).has_value(); },
                          common.wait_s);
  if (auto node = session.directory->node(name)) return *node;
  if (interrupted()) return Error{ErrorCode::kInterrupted, "stopped"};
  std::vector<std::string> names;
  for (const auto& one : session.directory->nodes()) names.push_back(one.name);
  const std::string near = nearest_word(name, names);
  return Error{ErrorCode::kNotFound,
               fmt::format("there is no node '{}' in domain {}{}; there are: {}", name, common.domain,
                           near.empty() ? "" : fmt::format("; did you mean '{}'?", near), join_words(names))};
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
    return Error{ErrorCode::kInvalidArgument, fmt::format("{} is no output: an input's messages are those of "
                                                          "the output that feeds it (nido port info {}), a "
                                                          "service is asked (nido port rpc {})",
                                                          port, port, port)};
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
    return find_port(session, {common.domain, common.json, 0.0, {}}, port).error();
  }
  auto type = type_named(session, common, port, type_name);
  if (!type) return type.error();
  source.type = *type != nullptr ? *type : type_of_bytes(type_name);
  return source;
}

}  // namespace nido::cli
