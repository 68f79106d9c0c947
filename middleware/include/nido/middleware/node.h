#pragma once

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/middleware/parameter.h"
#include "nido/middleware/port.h"
#include "nido/middleware/raw_port.h"
#include "nido/middleware/time.h"

namespace nido {

// Where a node's time comes from.
enum class ClockMode {
  kWall,       // the computer's clock
  kSimulated,  // /clock, as published by the robot process
  kLockstep,   // simulated, and the simulator waits for this node at every tick
};

// What a process needs to join a system. The launcher writes one such file for each process it starts.
struct NodeOptions {
  std::string name;  // "vision": unique in its domain
  int domain = 0;    // DDS domain, ROS_DOMAIN_ID
  ClockMode clock = ClockMode::kWall;
  double period_s = 0.01;                                        // how often run() calls the node
  std::uint64_t seed = 1;                                        // for the node's own random generators
  YAML::Node parameters;                                         // the node's own settings
  std::vector<std::pair<std::string, std::string>> connections;  // output name, own input name
  // SIGINT and SIGTERM end run() and publish_clock(); a process that has not ended 1 s later is ended, a
  // second signal ends it at once. The signals are blocked in all threads (children inherit that), so a
  // program that starts others says false and handles its signals itself.
  bool handle_signals = true;
  // Tools that look on: not announced to others, no log on /log, no control service.
  bool hidden = false;
};

// A process's place in the system: its ports, clock, parameters, log and life cycle. One per process, made in
// main(). Thread-safe unless noted. Typed ports need the message's type support: include
// "nido/middleware/typed_port.h" in the .cpp that opens them, not in headers.
class Node {
 public:
  // Reads `--node FILE` (as written by the launcher), or `--name`, `--domain`, `--set KEY=VALUE`... by hand.
  static Result<NodeOptions> options_from_args(int argc, char** argv, const std::string& default_name);
  // Joins the domain and announces the node as "starting". Fails with kTaken if the name has an owner.
  static Result<std::unique_ptr<Node>> create(NodeOptions options);

  Node() = default;
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  virtual ~Node() = default;

  [[nodiscard]] virtual const NodeOptions& options() const = 0;
  // The node's clock. Simulated: 0 until the first /clock; lockstep: the time of the tick being worked on.
  [[nodiscard]] virtual Time now() const = 0;

  // Ports. Names are absolute: "/vision/objects:o". `depth`: messages kept when nobody takes them (oldest go
  // first and are counted as lost), or for outputs the history of profile event. kTaken if the name has an
  // owner, in words that name its process and host.
  template <class T>
  Result<std::unique_ptr<Output<T>>> open_output(const std::string& port_name, Profile profile,
                                                 std::size_t depth = 16);
  template <class T>
  Result<std::unique_ptr<Input<T>>> open_input(const std::string& port_name, Profile profile,
                                               std::size_t depth = 16);

  // The same for a type that is chosen at run time (raw_port.h); the typed ones above are made of these.
  virtual Result<std::unique_ptr<RawOutput>> open_raw_output(const std::string& port_name,
                                                             const MessageType& type, Profile profile,
                                                             std::size_t depth) = 0;
  virtual Result<std::unique_ptr<RawInput>> open_raw_input(const std::string& port_name,
                                                           const MessageType& type, Profile profile,
                                                           std::size_t depth) = 0;

  // A port that answers lines of text ("/icubSim/world", "/icubSim/head/rpc:i"). The handler runs on a
  // middleware thread; the service ends when the returned object is destroyed.
  class Service {
   public:
    virtual ~Service() = default;
  };
  virtual Result<std::unique_ptr<Service>> open_service(
      const std::string& port_name, std::function<std::string(const std::string&)> handler) = 0;
  // Asks a text service: kNotFound without such a port, kTimeout without answer in timeout_s of wall time,
  // kInterrupted when asked to stop meanwhile; a node that was asked before has half a second left.
  virtual Result<std::string> call(const std::string& port_name, const std::string& text,
                                   double timeout_s) = 0;

  // Life cycle, seen by the launcher and `nido node info`.
  virtual void set_ready() = 0;
  virtual void set_failed(const std::string& sentence) = 0;
  // Where this process looks for a parameter: "cameras.width" in options().parameters; what was asked for is
  // listed, with its value and what is said of it, by `nido param list NODE`. kInvalidArgument names the key,
  // what was found and what is allowed. T: bool, int, double, std::string or a std::vector of these.
  template <class T>
  Result<T> parameter(const std::string& key, const T& value_if_absent, const ParameterAbout& about = {});
  // The same for one that `nido param set NODE KEY VALUE` changes while the node runs, at any moment: a run
  // in lockstep in which somebody does that is not repeatable.
  template <class T>
  Result<std::shared_ptr<const LiveParameter<T>>> live_parameter(const std::string& key,
                                                                 const T& value_if_absent,
                                                                 const ParameterAbout& about = {});

  // Calls on_tick(now) every period of the node's clock until SIGINT, SIGTERM, stop() or a failure of
  // on_tick, which it returns. In lockstep every message that other nodes wrote before this tick has arrived
  // when on_tick is called.
  virtual Status run(const std::function<Status(Time)>& on_tick) = 0;
  virtual void stop() = 0;
  // SIGINT, SIGTERM or stop() has come: for what waits in a loop of its own.
  [[nodiscard]] virtual bool is_stop_asked() const = 0;
  // The node that owns the clock (the robot process, with a simulator) drives it with this instead of run():
  // publishes `now` on /clock, in lockstep waits until every joined node has finished this tick. Returns
  // kInterrupted on SIGINT, SIGTERM, stop(). Lockstep: say options.clock = kLockstep and parameter `lockstep:
  // {nodes: [vision, reach]}`; those nodes are waited for before the first tick, others may join later by
  // themselves. The first call returns when all are there, so say set_ready() before it.
  virtual Status publish_clock(Time now) = 0;

  // Log: printed as one line and published on /log.
  virtual void log_debug(const std::string& text) = 0;
  virtual void log_info(const std::string& text) = 0;
  virtual void log_warning(const std::string& text) = 0;
  virtual void log_error(const std::string& text) = 0;

 protected:
  // Lists a parameter as in use. `set` takes a new value, if there may be one.
  virtual void note_parameter(ParameterDescription description,
                              std::function<Status(const YAML::Node& value)> set) = 0;
};

// Runs a node program: parses arguments, creates the node, calls `body(node)`, prints a failure as one
// sentence. Returns the process's exit code. `main` of every node is one call of this.
int node_main(int argc, char** argv, const std::string& default_name,
              const std::function<Status(Node&)>& body);

template <class T>
Result<T> Node::parameter(const std::string& key, const T& value_if_absent, const ParameterAbout& about) {
  YAML::Node given = find_parameter(options().parameters, key);
  if (!given.IsDefined()) given = value_if_absent;
  Result<T> value =
      detail::checked_parameter<T>(given, about, "parameter " + key + " of node " + options().name);
  if (value) {
    note_parameter({key, detail::parameter_type<T>(), parameter_text(given), about, false}, nullptr);
  }
  return value;
}

template <class T>
Result<std::shared_ptr<const LiveParameter<T>>> Node::live_parameter(const std::string& key,
                                                                     const T& value_if_absent,
                                                                     const ParameterAbout& about) {
  const Result<T> value = parameter(key, value_if_absent, about);
  if (!value) return value.error();
  const auto live = std::make_shared<LiveParameter<T>>(*value);
  const std::string place = "parameter " + key + " of node " + options().name;
  YAML::Node shown;
  shown = *value;
  note_parameter({key, detail::parameter_type<T>(), parameter_text(shown), about, true},
                 [live, about, place](const YAML::Node& next) -> Status {
                   Result<T> checked = detail::checked_parameter<T>(next, about, place);
                   if (!checked) return checked.error();
                   live->set(std::move(*checked));
                   return {};
                 });
  return std::shared_ptr<const LiveParameter<T>>(live);
}

}  // namespace nido
