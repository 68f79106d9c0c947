#include "nido/yarp/port_host.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <set>
#include <thread>
#include <utility>

#include "admin.h"
#include "connections.h"
#include "name_client.h"
#include "sockets.h"

namespace nido::yarp {
namespace {

std::chrono::steady_clock::duration seconds(double s) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(s));
}

// "tcp:/b", "tcp://b", "/b": the carrier, if one is named, and the port
std::pair<std::string, std::string> split_target(std::string target) {
  const std::size_t colon = target.find(':');
  if (colon == std::string::npos || target.starts_with('/')) return {"", std::move(target)};
  std::string carrier = target.substr(0, colon);
  std::string name = target.substr(colon + 1);
  while (name.starts_with("//")) name.erase(0, 1);
  return {std::move(carrier), std::move(name)};
}

class Host final : public PortHost, public ConnectionOwner, public AdminActions {
 public:
  Host(EventLoop& loop, PortHostOptions options)
      : loop_(loop), options_(std::move(options)), alive_(std::make_shared<Host*>(this)) {}

  ~Host() override {
    *alive_ = nullptr;
    for (auto& [name, port] : ports_) loop_.unwatch(port.listener.get());
  }

  Status start() {
    if (!options_.network && !is_loopback(options_.host) && options_.secret.empty()) {
      return Error{
          ErrorCode::kInvalidArgument,
          fmt::format("ports on {} would be open to a network: without a secret only loopback addresses "
                      "(127.0.0.1) are allowed, since whoever connects may move the robot",
                      options_.host)};
    }
    if (!options_.secret.empty() && options_.names == PortHostOptions::Names::kRegister) {
      return Error{ErrorCode::kUnsupported,
                   "with a secret, names are served here: another name server is not asked"};
    }
    if (options_.host == "0.0.0.0") {
      return Error{ErrorCode::kInvalidArgument,
                   "0.0.0.0 is no address that others can be told: give one of this computer's"};
    }
    if (options_.names == PortHostOptions::Names::kServe) {
      NameRegistry::Options registry;
      registry.host = options_.host;
      registry.own_port = options_.names_port;
      registry.first_port = options_.first_port > 0 ? options_.first_port : options_.names_port + 2;
      registry.last_port = std::min(65'535, registry.first_port + 20'000);
      registry_.emplace(registry);
      PortSpec root;
      root.name = registry.own_name;
      root.takes = true;
      root.about = "the name server";
      if (Status opened = open_listener(std::move(root), options_.names_port); !opened) return opened;
    } else {
      names_client_ = std::make_unique<NameClient>(
          loop_, options_.names_host.empty() ? options_.host : options_.names_host, options_.names_port);
    }
    std::weak_ptr<Host*> alive = alive_;
    loop_.every(0.25, [alive] {
      if (const auto self = alive.lock(); self && *self != nullptr) (*self)->look_at_clock();
    });
    return {};
  }

  // -- PortHost

  Status open_port(PortSpec spec) override {
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
      if (registry_ && registry_->is_taken(number)) continue;
      Status opened = open_listener(spec, number);
      if (opened || opened.error().code != ErrorCode::kTaken) return opened;
    }
    return Error{ErrorCode::kTaken, fmt::format("no port number from {} on is free", options_.names_port)};
  }

  void close_port(const std::string& name) override {
    const auto found = ports_.find(name);
    if (found == ports_.end()) return;
    for (const std::uint64_t id : std::set<std::uint64_t>(found->second.out))
      outs_.at(id)->end("the port closes");
    for (const std::uint64_t id : std::set<std::uint64_t>(found->second.in)) end_in(id);
    loop_.unwatch(found->second.listener.get());
    ports_.erase(name);
    if (registry_) registry_->remove_own(name);
    if (names_client_) names_client_->ask("unregister " + name, [](auto) {});
  }

  bool has_port(const std::string& name) const override { return ports_.contains(name); }
  int number_of(const std::string& name) const override {
    const auto found = ports_.find(name);
    return found == ports_.end() ? 0 : found->second.number;
  }

  void publish(const std::string& name, std::shared_ptr<const Content> content,
               std::string envelope) override {
    std::weak_ptr<Host*> alive = alive_;
    loop_.post([alive, name, content = std::move(content), envelope = std::move(envelope)] {
      if (const auto self = alive.lock(); self && *self != nullptr) (*self)->give(name, content, envelope);
    });
  }

  void connect(const std::string& output, const std::string& target, Carrier carrier,
               std::function<void(Status)> done) override {
    find(target, [this, output, target, carrier, done = std::move(done)](std::optional<Contact> contact) {
      if (!contact) return done(Error{ErrorCode::kNotFound, "Do not know how to connect to " + target});
      connect_to(output, *contact, carrier, done);
    });
  }

  void find(const std::string& name, std::function<void(std::optional<Contact>)> done) override {
    if (const auto own = ports_.find(name); own != ports_.end()) {
      return done(Contact{name, options_.host, own->second.number, "tcp"});
    }
    if (registry_) return done(registry_->find(name));
    names_client_->ask("query " + name, [done = std::move(done)](Result<std::vector<std::string>> lines) {
      if (!lines || lines->empty()) return done(std::nullopt);
      done(contact_from_line(lines->front()));
    });
  }

  Figures figures() const override {
    return {ports_.size(), ins_.size() + outs_.size(), refused_, lost_, *held_ + *working_};
  }

  // -- ConnectionOwner

  void on_event(std::uint64_t id, Event event) override {
    InConnection& in = *ins_.at(id);
    const auto found = ports_.find(in.port);
    if (found == ports_.end()) return in.finish({});
    std::visit([&](auto& what) { handle(in, found->second, what); }, event);
  }

  void on_end(std::uint64_t id, const std::string& reason) override {
    std::string port_name;
    bool was_reader = false;
    if (const auto in = ins_.find(id); in != ins_.end()) {
      port_name = in->second->port;
      was_reader = in->second->is_reversed;
      bury(std::move(in->second));
      ins_.erase(in);
    } else if (const auto out = outs_.find(id); out != outs_.end()) {
      port_name = out->second->port;
      was_reader = true;
      log_end(*out->second, reason);
      bury(std::move(out->second));
      outs_.erase(out);
    }
    const auto port = ports_.find(port_name);
    if (port == ports_.end()) return;
    port->second.in.erase(id);
    port->second.out.erase(id);
    if (was_reader) tell_readers(port->second);
    tell_writers(port->second);
  }

  void on_lost(std::size_t messages) override { lost_ += messages; }

  // not now: the connection that grew is still at work
  void on_held() override {
    if (*held_ <= options_.memory || relieving_) return;
    relieving_ = true;
    std::weak_ptr<Host*> alive = alive_;
    loop_.post([alive] {
      if (const auto self = alive.lock(); self && *self != nullptr) (*self)->relieve();
    });
  }
  HeldTotal held_total() const override { return held_; }

  // -- AdminActions

  std::vector<Route> routes(const std::string& port_name, bool outgoing) const override {
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

  std::string address_of(const std::string& port_name) const override {
    return fmt::format("tcp://{}:{}/", options_.host, number_of(port_name));
  }
  bool gives(const std::string& port_name) const override { return ports_.at(port_name).spec.gives; }
  bool takes(const std::string& port_name) const override { return ports_.at(port_name).spec.takes; }

  void add_output(const std::string& port_name, const std::string& given, const std::string& given_carrier,
                  std::function<void(Status)> done) override {
    const auto found = ports_.find(port_name);
    if (found == ports_.end()) return done(Error{ErrorCode::kNotFound, "the port is gone"});
    auto [carrier_name, target] = split_target(given);
    if (!given_carrier.empty()) carrier_name = given_carrier;
    if (carrier_name.empty()) carrier_name = "tcp";
    if (!found->second.spec.gives) {
      return done(Error{ErrorCode::kUnsupported, "Outputs not allowed"});
    }
    if (found->second.spec.connect_natively && found->second.spec.connect_natively(target, true, done))
      return;
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

  void remove(const std::string& port_name, const std::string& target, bool outputs, bool inputs,
              std::function<void(bool output, bool input)> done) override {
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

 private:
  struct HostedPort {
    PortSpec spec;
    Fd listener;
    int number = 0;
    std::set<std::uint64_t> in;   // connections that somebody made
    std::set<std::uint64_t> out;  // connections that we made
    std::map<std::string, Bottle> properties;
  };

  Status open_listener(PortSpec spec, int number) {
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
    if (registry_) registry_->add_own({name, options_.host, port.number, "tcp"});
    if (names_client_) {
      names_client_->ask(
          fmt::format("register {} tcp {} {}", name, options_.host, port.number),
          [this, name](const Result<std::vector<std::string>>& lines) {
            if (!lines) options_.log(fmt::format("{} is not registered: {}", name, lines.error().message));
          });
      names_client_->ask(fmt::format("set {} offers tcp text text_ack udp fast_tcp", name),
                         [](const auto&) {});
      names_client_->ask(fmt::format("set {} accepts tcp text text_ack udp fast_tcp", name),
                         [](const auto&) {});
      names_client_->ask(fmt::format("set {} ips {}", name, options_.host), [](const auto&) {});
      names_client_->ask(fmt::format("set {} process {}", name, getpid()), [](const auto&) {});
    }
    return {};
  }

  void on_caller(const std::string& name) {
    const auto found = ports_.find(name);
    if (found == ports_.end()) return;
    for (int rounds = 0; rounds < 32; ++rounds) {
      std::string peer;
      Fd fd = accept_tcp(found->second.listener.get(), peer);
      if (!fd.is_open()) return;
      if (ins_.size() + outs_.size() >= options_.connections && !make_room()) {
        note_refusal(name, peer, "there are too many connections");
        continue;
      }
      const std::uint64_t id = ++last_id_;
      auto in = std::make_unique<InConnection>(
          id, loop_, *this, std::move(fd), peer, found->second.spec.limits, found->second.spec.queue,
          std::chrono::steady_clock::now() + seconds(options_.handshake_s), options_.secret);
      in->port = name;
      in->dialect = options_.dialect;
      if (!in->start()) continue;
      found->second.in.insert(id);
      ins_[id] = std::move(in);
    }
  }

  // ends the oldest connection that has not said yet what it wants; false when all have
  bool make_room() {
    for (const auto& [id, in] : ins_) {
      if (in->is_opened()) continue;
      end_in(id);
      return true;
    }
    return false;
  }

  // ends the connections that keep most until the others have room
  void relieve() {
    relieving_ = false;
    const auto less = [](const auto& a, const auto& b) {
      return a.second->held_bytes() < b.second->held_bytes();
    };
    while (*held_ > options_.memory) {
      const auto in = std::max_element(ins_.begin(), ins_.end(), less);
      const auto out = std::max_element(outs_.begin(), outs_.end(), less);
      const std::size_t in_bytes = in == ins_.end() ? 0 : in->second->held_bytes();
      const std::size_t out_bytes = out == outs_.end() ? 0 : out->second->held_bytes();
      if (in_bytes == 0 && out_bytes == 0) return;
      const auto reason = [&](std::size_t bytes) {
        return fmt::format("all connections together keep more than {} bytes, it keeps most ({})",
                           options_.memory, bytes);
      };
      if (in_bytes >= out_bytes) {
        note_refusal(in->second->port, in->second->peer, reason(in_bytes));
        end_in(in->first);
      } else {
        out->second->end(reason(out_bytes));
      }
    }
  }

  void end_in(std::uint64_t id) {
    const auto in = ins_.find(id);
    if (in == ins_.end()) return;
    in->second->hang_up("ended");
  }

  void look_at_clock() {
    const auto now = std::chrono::steady_clock::now();
    std::vector<std::uint64_t> late;
    for (const auto& [id, in] : ins_) {
      if (in->is_late(now)) late.push_back(id);
    }
    for (const std::uint64_t id : late) {
      note_refusal(ins_.at(id)->port, ins_.at(id)->peer, "it said nothing");
      end_in(id);
    }
    late.clear();
    for (const auto& [id, out] : outs_) {
      if (out->is_late(now)) late.push_back(id);
    }
    for (const std::uint64_t id : late) {
      if (const auto out = outs_.find(id); out != outs_.end())
        out->second->end("the far side does not answer");
    }
    if (names_client_) names_client_->look_at_clock();
  }

  void note_refusal(const std::string& port, const std::string& peer, const std::string& reason) {
    ++refused_;
    // a flood of refusals is told once a second
    const auto now = std::chrono::steady_clock::now();
    if (now - told_ < std::chrono::seconds(1)) {
      ++untold_;
      return;
    }
    told_ = now;
    const std::string more = untold_ > 0 ? fmt::format(" (and {} before)", untold_) : "";
    untold_ = 0;
    options_.log(fmt::format("{}: a connection from {} was refused: {}{}", port, peer, reason, more));
  }

  void log_end(const OutConnection& out, const std::string& reason) {
    if (reason != "asked to" && reason != "the port closes") {
      options_.log(fmt::format("{} to {} ended: {}", out.port, out.target.name, reason));
    }
  }

  template <class Connection>
  void bury(std::unique_ptr<Connection> connection) {
    connection->let_go();
    // it is still at work: it goes when nobody is
    std::shared_ptr<Connection> shared = std::move(connection);
    loop_.post([shared] {});
  }

  void tell_readers(const HostedPort& port) {
    if (!port.spec.on_readers) return;
    std::size_t readers = 0;
    for (const std::uint64_t id : port.out) readers += outs_.at(id)->is_ready() ? 1 : 0;
    for (const std::uint64_t id : port.in) readers += ins_.at(id)->is_reversed ? 1 : 0;
    port.spec.on_readers(readers);
  }

  // connections with a port's name: people and tools that only ask have none
  void tell_writers(const HostedPort& port) {
    if (!port.spec.on_writers) return;
    std::size_t writers = 0;
    for (const std::uint64_t id : port.in) {
      const InConnection& in = *ins_.at(id);
      writers += in.is_opened() && !in.is_reversed && in.sender.starts_with('/') ? 1 : 0;
    }
    port.spec.on_writers(writers);
  }

  void give(const std::string& name, const std::shared_ptr<const Content>& content,
            const std::string& envelope) {
    const auto port = ports_.find(name);
    if (port == ports_.end()) return;
    for (const std::uint64_t id : std::set<std::uint64_t>(port->second.out)) {
      if (const auto out = outs_.find(id); out != outs_.end()) out->second->give(content, envelope);
    }
    for (const std::uint64_t id : std::set<std::uint64_t>(port->second.in)) {
      if (const auto in = ins_.find(id); in != ins_.end() && in->second->is_reversed) {
        in->second->give(content, envelope);
      }
    }
  }

  void connect_to(const std::string& output, const Contact& contact, Carrier carrier,
                  const std::function<void(Status)>& done) {
    const auto port = ports_.find(output);
    if (port == ports_.end()) return done(Error{ErrorCode::kNotFound, "the port is gone"});
    if (!options_.network && options_.secret.empty() && !is_loopback(contact.host)) {
      return done(
          Error{ErrorCode::kUnsupported,
                fmt::format("Cannot connect to {}: {} is not on this computer", contact.name, contact.host)});
    }
    if (ins_.size() + outs_.size() >= options_.connections) {
      return done(Error{ErrorCode::kFailed, "there are too many connections"});
    }
    // one connection between two ports
    for (const std::uint64_t id : std::set<std::uint64_t>(port->second.out)) {
      if (outs_.at(id)->target.name == contact.name) outs_.at(id)->end("asked to");
    }
    const std::uint64_t id = ++last_id_;
    auto out = std::make_unique<OutConnection>(
        id, loop_, *this, output, contact, carrier, port->second.spec.queue, options_.dialect,
        std::chrono::steady_clock::now() + seconds(options_.connect_s), options_.secret);
    OutConnection* raw = out.get();
    outs_[id] = std::move(out);
    port->second.out.insert(id);
    raw->start([this, output, done](const Status& status) {
      done(status);
      if (const auto found = ports_.find(output); status && found != ports_.end())
        tell_readers(found->second);
    });
  }

  // -- what comes on a connection

  void handle(InConnection& in, HostedPort& port, Opened& opened) {
    // a sender that connects again, after a crash perhaps, takes the place of its former connection
    if (opened.sender.starts_with('/')) {
      for (const std::uint64_t id : std::set<std::uint64_t>(port.in)) {
        if (id != in.id && ins_.at(id)->sender == opened.sender) end_in(id);
      }
    }
    in.accept(opened.sender, port.number, options_.host);
    tell_writers(port);
  }

  void handle(InConnection& in, HostedPort& port, Data& data) {
    const std::uint64_t id = in.id;
    const bool text = is_text(in.stream.carrier());
    if (registry_ && port.number == options_.names_port) return answer_names(in, data);
    if (!port.spec.takes || !port.spec.on_message) {
      std::optional<Bottle> reply;
      if (data.wants_reply) {
        reply = Bottle{Value::word("fail"),
                       Value::string(port.spec.name + " gives messages, it does not take any; "
                                                      "'r' reads it")};
      }
      return in.answer(in.stream.answer(reply, in.dialect));
    }
    // of what is long, and leaves no room for what is short
    constexpr std::size_t kShort = 4096;
    if (data.bytes.size() > kShort && *working_ > options_.memory) {
      note_refusal(port.spec.name, in.peer, "too many bytes wait to be worked on");
      return in.finish({});
    }
    Incoming incoming;
    incoming.held = std::make_shared<const Held>(working_, data.bytes.capacity());
    incoming.bytes = std::move(data.bytes);
    incoming.is_text = text;
    incoming.envelope = std::move(data.envelope);
    incoming.sender = in.sender;
    incoming.wants_reply = data.wants_reply;
    incoming.dialect = in.dialect;
    std::weak_ptr<Host*> alive = alive_;
    const bool wants_reply = data.wants_reply;
    // answered here and now, or later from another thread
    incoming.answer = [alive, id, wants_reply, this_thread = std::this_thread::get_id(),
                       loop = &loop_](std::optional<Bottle> reply) {
      auto send = [alive, id, wants_reply, reply = std::move(reply)] {
        const auto self = alive.lock();
        if (self && *self != nullptr) (*self)->answer_message(id, wants_reply ? reply : std::nullopt);
      };
      if (std::this_thread::get_id() == this_thread) {
        send();
      } else {
        loop->post(std::move(send));
      }
    };
    // which dialect this is, for the reply
    if (!text) {
      const Result<Decoded> decoded = decode_cheaply(incoming.bytes, in.dialect);
      if (decoded) in.dialect = decoded->dialect;
    }
    port.spec.on_message(std::move(incoming));
  }

  // objects that are long are images and the like: both dialects write them alike
  static Result<Decoded> decode_cheaply(const std::string& bytes, Dialect preferred) {
    constexpr std::size_t kLongest = 4096;
    if (bytes.size() > kLongest) return Error{};
    return decode_any(bytes, preferred);
  }

  void answer_message(std::uint64_t id, const std::optional<Bottle>& reply) {
    const auto in = ins_.find(id);
    if (in == ins_.end()) return;
    in->second->answer(in->second->stream.answer(reply, in->second->dialect));
  }

  void answer_names(InConnection& in, const Data& data) {
    if (is_text(in.stream.carrier())) {
      std::string lines = registry_->answer(data.bytes, in.peer);
      return in.answer(lines + in.stream.answer(std::nullopt, in.dialect));
    }
    Result<Decoded> request = decode_any(data.bytes, in.dialect);
    std::optional<Bottle> reply;
    if (data.wants_reply) {
      reply = request ? registry_->answer_bottle(request->bottle, in.peer)
                      : Bottle{Value::string("error"), Value::string(request.error().message)};
    }
    in.answer(in.stream.answer(reply, in.dialect));
  }

  void handle(InConnection& in, HostedPort& port, Admin& admin) {
    const bool text = is_text(in.stream.carrier());
    Bottle command;
    if (text) {
      Result<Bottle> parsed = parse_bottle(admin.bytes);
      if (!parsed) return answer_admin(in.id, {Value::word("fail"), Value::string(parsed.error().message)});
      command = std::move(*parsed);
    } else {
      Result<Decoded> decoded = decode_any(admin.bytes, in.dialect);
      if (!decoded) {
        note_refusal(port.spec.name, in.peer, decoded.error().message);
        return in.finish({});
      }
      command = std::move(decoded->bottle);
    }
    const std::uint64_t id = in.id;
    std::weak_ptr<Host*> alive = alive_;
    answer_admin_command(*this, port.spec.name, port.properties, command, [alive, id](Bottle reply) {
      if (const auto self = alive.lock(); self && *self != nullptr)
        (*self)->answer_admin(id, std::move(reply));
    });
  }

  void answer_admin(std::uint64_t id, Bottle reply) {
    const auto in = ins_.find(id);
    if (in == ins_.end()) return;
    in->second->answer(in->second->stream.answer(std::move(reply), in->second->dialect));
  }

  void handle(InConnection& in, HostedPort& port, Describe&) {
    in.answer((is_text(in.stream.carrier()) ? describe(*this, port.spec.name) : std::string()) +
              in.stream.answer(std::nullopt, in.dialect));
  }

  void handle(InConnection& in, HostedPort& port, ShowHelp&) {
    in.answer(
        (is_text(in.stream.carrier()) ? help_for_people(port.spec.name, port.spec.about) : std::string()) +
        in.stream.answer(std::nullopt, in.dialect));
  }

  void handle(InConnection& in, HostedPort& port, Reverse&) {
    if (!port.spec.gives) return in.answer({});
    in.reverse();
    tell_readers(port);
  }

  void handle(InConnection& in, HostedPort& port, AddOutput& add) {
    const std::uint64_t id = in.id;
    std::weak_ptr<Host*> alive = alive_;
    const auto say = [alive, id](const std::string& line) {
      const auto self = alive.lock();
      if (!self || *self == nullptr) return;
      if (const auto found = (*self)->ins_.find(id); found != (*self)->ins_.end()) {
        InConnection& connection = *found->second;
        connection.answer(line + "\r\n" + connection.stream.answer(std::nullopt, connection.dialect));
      }
    };
    const std::string name = port.spec.name;
    const std::string target = add.target;
    switch (add.what) {
      case AddOutput::What::kConnect:
        add_output(name, target, {}, [say, name, target](const Status& status) {
          say(status ? "Added connection from " + name + " to " + target : status.error().message);
        });
        return;
      case AddOutput::What::kDisconnectOutput:
        return remove(name, target, true, false, [say, name, target](bool output, bool) {
          say(output ? "Removed connection from " + name + " to " + target
                     : "Could not find an outgoing connection to " + target);
        });
      case AddOutput::What::kDisconnectInput:
        return remove(name, target, false, true, [say, name, target](bool, bool input) {
          say(input ? "Removing connection from " + target + " to " + name
                    : "Could not find an incoming connection from " + target);
        });
    }
  }

  void handle(InConnection& in, HostedPort&, Quit&) {
    in.finish(in.stream.carrier() == Carrier::kTcp || in.stream.carrier() == Carrier::kTextAck
                  ? in.stream.answer(std::nullopt, in.dialect)
                  : std::string());
  }

  void handle(InConnection& in, HostedPort& port, NameRequest& request) {
    if (!registry_ || port.number != options_.names_port) {
      note_refusal(port.spec.name, in.peer, "it asks for names, which are not served on this port");
      return in.finish(std::string(kEndOfAnswer) + "\r\n");
    }
    in.mark_opened();
    in.answer(registry_->answer(request.line, in.peer));
  }

  void handle(InConnection& in, HostedPort& port, HttpRequest&) {
    std::string page = describe(*this, port.spec.name) + "\r\n" + port.spec.about + "\r\n";
    in.finish(fmt::format("HTTP/1.0 200 OK\r\nContent-Type: text/plain\r\nContent-Length: {}\r\n\r\n{}",
                          page.size(), page));
  }

  void handle(InConnection& in, HostedPort& port, Refused& refused) {
    note_refusal(port.spec.name, in.peer, refused.reason);
    in.finish(refused.farewell);
  }

  EventLoop& loop_;
  PortHostOptions options_;
  std::shared_ptr<Host*> alive_;
  std::optional<NameRegistry> registry_;
  std::unique_ptr<NameClient> names_client_;
  std::map<std::string, HostedPort> ports_;
  std::map<std::uint64_t, std::unique_ptr<InConnection>> ins_;
  std::map<std::uint64_t, std::unique_ptr<OutConnection>> outs_;
  std::uint64_t last_id_ = 0;
  int next_number_ = 0;
  std::uint64_t refused_ = 0;
  std::uint64_t lost_ = 0;
  const HeldTotal held_ = std::make_shared<std::atomic<std::size_t>>(0);     // by connections
  const HeldTotal working_ = std::make_shared<std::atomic<std::size_t>>(0);  // by messages that are worked on
  bool relieving_ = false;
  SteadyTime told_;
  std::uint64_t untold_ = 0;
};

}  // namespace

Result<std::unique_ptr<PortHost>> PortHost::open(EventLoop& loop, PortHostOptions options) {
  auto host = std::make_unique<Host>(loop, std::move(options));
  if (Status started = host->start(); !started) return started.error();
  return std::unique_ptr<PortHost>(std::move(host));
}

}  // namespace nido::yarp
