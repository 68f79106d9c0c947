#include "nido/yarp/port_host.h"

#include <fmt/format.h>

#include <utility>

#include "host.h"
#include "sockets.h"

namespace nido::yarp {
namespace {

// "tcp:/b", "tcp://b", "/b": the carrier, if one is named, and the port
std::pair<std::string, std::string> split_target(std::string target) {
  const std::size_t colon = target.find(':');
  if (colon == std::string::npos || target.starts_with('/')) return {"", std::move(target)};
  std::string carrier = target.substr(0, colon);
  std::string name = target.substr(colon + 1);
  while (name.starts_with("//")) name.erase(0, 1);
  return {std::move(carrier), std::move(name)};
}

}  // namespace

Host::~Host() {
  *alive_ = nullptr;
  for (auto& [name, port] : ports_) loop_.unwatch(port.listener.get());
}

Status Host::start() {
  if (!options_.network && !is_loopback(options_.host) && options_.secret.empty()) {
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("ports on {} would be open to a network: without a secret only loopback addresses "
                    "(127.0.0.1) are allowed, since whoever connects may move the robot",
                    options_.host)};
  }
  if (options_.host == "0.0.0.0") {
    return Error{ErrorCode::kInvalidArgument,
                 "0.0.0.0 is no address that others can be told: give one of this computer's"};
  }
  if (names_.are_served()) {
    PortSpec root;
    root.name = names_.own_name();
    root.takes = true;
    root.about = "the name server";
    if (Status opened = open_listener(std::move(root), options_.names_port); !opened) return opened;
  }
  std::weak_ptr<Host*> alive = alive_;
  loop_.every(0.25, [alive] {
    if (const auto self = alive.lock(); self && *self != nullptr) (*self)->look_at_clock();
  });
  return {};
}

Status Host::open_port(PortSpec spec) {
  if (spec.name.empty() || spec.name.front() != '/') {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("'{}' is no name of a port: it begins with '/'", spec.name)};
  }
  if (ports_.contains(spec.name)) {
    return Error{ErrorCode::kTaken, fmt::format("this program has a port {} already", spec.name)};
  }
  const std::string name = spec.name;
  if (options_.first_port == 0 && options_.names == PortHostOptions::Names::kRegister) {
    return open_listener(std::move(spec), 0);
  }
  // the next number that is free
  if (next_number_ == 0)
    next_number_ = options_.first_port > 0 ? options_.first_port : options_.names_port + 2;
  for (int tried = 0; tried < 2000; ++tried) {
    const int number = next_number_++;
    // a number that was given to somebody who has not opened it yet
    if (names_.is_given(number)) continue;
    Status opened = open_listener(spec, number);
    if (opened || opened.error().code != ErrorCode::kTaken) return opened;
  }
  return Error{ErrorCode::kTaken, fmt::format("no port number from {} on is free", options_.names_port)};
}

void Host::close_port(const std::string& name) {
  const auto found = ports_.find(name);
  if (found == ports_.end()) return;
  for (const std::uint64_t id : std::set<std::uint64_t>(found->second.out))
    outs_.at(id)->end("the port closes");
  for (const std::uint64_t id : std::set<std::uint64_t>(found->second.in)) end_in(id);
  loop_.unwatch(found->second.listener.get());
  ports_.erase(name);
  names_.remove(name);
}

int Host::number_of(const std::string& name) const {
  const auto found = ports_.find(name);
  return found == ports_.end() ? 0 : found->second.number;
}

void Host::publish(const std::string& name, std::shared_ptr<const Content> content, std::string envelope) {
  std::weak_ptr<Host*> alive = alive_;
  loop_.post([alive, name, content = std::move(content), envelope = std::move(envelope)] {
    if (const auto self = alive.lock(); self && *self != nullptr) (*self)->give(name, content, envelope);
  });
}

void Host::connect(const std::string& output, const std::string& target, Carrier carrier,
                   std::function<void(Status)> done) {
  find(target, [this, output, target, carrier, done = std::move(done)](std::optional<Contact> contact) {
    if (!contact) return done(Error{ErrorCode::kNotFound, "Do not know how to connect to " + target});
    connect_to(output, *contact, carrier, done);
  });
}

void Host::find(const std::string& name, std::function<void(std::optional<Contact>)> done) {
  if (const auto own = ports_.find(name); own != ports_.end()) {
    return done(Contact{name, options_.host, own->second.number, "tcp"});
  }
  names_.find(name, std::move(done));
}

PortHost::Figures Host::figures() const {
  return {ports_.size(), ins_.size() + outs_.size(), refused_, lost_, *held_ + *working_};
}

std::vector<Route> Host::routes(const std::string& port_name, bool outgoing) const {
  std::vector<Route> out;
  const auto found = ports_.find(port_name);
  if (found == ports_.end()) return out;
  for (const std::uint64_t id : found->second.out) {
    const OutConnection& connection = *outs_.at(id);
    if (outgoing && connection.is_ready()) {
      out.push_back({port_name, connection.target.name, std::string(to_string(connection.carrier))});
    }
  }
  for (const std::uint64_t id : found->second.in) {
    const InConnection& connection = *ins_.at(id);
    if (!connection.is_opened() || connection.is_reversed != outgoing) continue;
    const std::string carrier(to_string(connection.stream.carrier()));
    if (outgoing) {
      out.push_back({port_name, connection.sender, carrier});
    } else {
      out.push_back({connection.sender, port_name, carrier});
    }
  }
  if (outgoing && found->second.spec.native_outputs) {
    for (const std::string& target : found->second.spec.native_outputs())
      out.push_back({port_name, target, "dds"});
  }
  return out;
}

std::string Host::address_of(const std::string& port_name) const {
  return fmt::format("tcp://{}:{}/", options_.host, number_of(port_name));
}

void Host::add_output(const std::string& port_name, const std::string& given,
                      const std::string& given_carrier, std::function<void(Status)> done) {
  const auto found = ports_.find(port_name);
  if (found == ports_.end()) return done(Error{ErrorCode::kNotFound, "the port is gone"});
  auto [carrier_name, target] = split_target(given);
  if (!given_carrier.empty()) carrier_name = given_carrier;
  if (carrier_name.empty()) carrier_name = "tcp";
  if (!found->second.spec.gives) {
    return done(Error{ErrorCode::kUnsupported, "Outputs not allowed"});
  }
  if (found->second.spec.connect_natively && found->second.spec.connect_natively(target, true, done)) return;
  const std::optional<Carrier> carrier = carrier_from_string(carrier_name);
  if (!carrier) {
    return done(
        Error{ErrorCode::kUnsupported,
              fmt::format("Cannot connect to {}: carrier {} is not known here: tcp, fast_tcp, udp, text, "
                          "text_ack are",
                          target, carrier_name)});
  }
  connect(port_name, target, *carrier, std::move(done));
}

void Host::remove(const std::string& port_name, const std::string& target, bool outputs, bool inputs,
                  std::function<void(bool output, bool input)> done) {
  const auto found = ports_.find(port_name);
  if (found == ports_.end()) return done(false, false);
  bool was_output = false;
  bool was_input = false;
  for (const std::uint64_t id : std::set<std::uint64_t>(found->second.out)) {
    if (!outputs || outs_.at(id)->target.name != target) continue;
    outs_.at(id)->end("asked to");
    was_output = true;
  }
  for (const std::uint64_t id : std::set<std::uint64_t>(found->second.in)) {
    const InConnection& in = *ins_.at(id);
    if (in.sender != target || (in.is_reversed ? !outputs : !inputs)) continue;
    (in.is_reversed ? was_output : was_input) = true;
    end_in(id);
  }
  if (outputs && !was_output && found->second.spec.connect_natively) {
    const auto told = [done, was_input](const Status& status) { done(status.ok(), was_input); };
    if (found->second.spec.connect_natively(target, false, told)) return;
  }
  done(was_output, was_input);
}

Status Host::open_listener(PortSpec spec, int number) {
  Result<Fd> listener = listen_tcp(options_.host, number);
  if (!listener) return listener.error();
  const std::string name = spec.name;
  const int fd = listener->get();
  if (Status watched = loop_.watch(fd, true, false, [this, name](EventLoop::Happened) { on_caller(name); });
      !watched) {
    return watched;
  }
  HostedPort& port = ports_[name];
  port.spec = std::move(spec);
  port.listener = std::move(*listener);
  port.number = local_port(fd);
  names_.add({name, options_.host, port.number, "tcp"});
  return {};
}

Result<std::unique_ptr<PortHost>> PortHost::open(EventLoop& loop, PortHostOptions options) {
  auto host = std::make_unique<Host>(loop, std::move(options));
  if (Status started = host->start(); !started) return started.error();
  return std::unique_ptr<PortHost>(std::move(host));
}

}  // namespace nido::yarp
