#include "node_impl.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "nido/middleware/network.h"
#include "nido/middleware/port_name.h"
#include "nido/middleware/typed_port.h"

namespace nido {

namespace {

using Steady = std::chrono::steady_clock;

// how long a process may be silent before the others forget it
constexpr int kLease_s = 3;
constexpr int kLockstepLease_s = 60;
// for a call of a node that was asked to stop, and will be ended soon if it does not
constexpr double kParting_s = 0.5;

Quality last_one() {
  Quality quality;
  quality.transient_local = true;
  return quality;
}

msgs::Time to_message(Time time) {
  msgs::Time message;
  message.sec(static_cast<std::int32_t>(time.ns / 1'000'000'000));
  message.nanosec(static_cast<std::uint32_t>(time.ns % 1'000'000'000));
  return message;
}

Time wall_now() {
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(
              std::chrono::system_clock::now().time_since_epoch())
              .count()};
}

std::string restarts_from_environment() {
  const char* count = std::getenv("NIDO_RESTARTS");  // NOLINT(concurrency-mt-unsafe): nobody sets it here
  return count == nullptr ? "" : count;
}

std::int64_t period_ns(const NodeOptions& options) { return Time::from_seconds(options.period_s).ns; }

// A node's calls fall on the first tick at or after each period, counted from its first tick.
class Rhythm {
 public:
  explicit Rhythm(std::int64_t period) : period_(period) {}
  bool is_due(Time now) {
    if (!started_ || now.ns < last_) {  // the first tick, or the clock began anew
      started_ = true;
      next_ = now.ns;
    }
    last_ = now.ns;
    if (now.ns < next_) {
      return false;
    }
    next_ += ((now.ns - next_) / period_ + 1) * period_;
    return true;
  }

 private:
  const std::int64_t period_;
  bool started_ = false;
  std::int64_t next_ = 0;
  std::int64_t last_ = 0;
};

}  // namespace

// Follows /clock.
class NodeImpl::ClockReader final : public ReaderEvents {
 public:
  explicit ClockReader(NodeImpl& node) : node_(node) {}
  Status open() {
    auto reader =
        Reader::open(node_.participant_, "rt/clock", message_type_of<msgs::Clock>(), last_one(), "", *this);
    if (!reader) {
      return reader.error();
    }
    reader_ = std::move(reader).value();
    return {};
  }
  void on_message(std::shared_ptr<void> message, const MessageInfo& /*info*/) override {
    const auto& clock = static_cast<msgs::Clock*>(message.get())->clock();
    node_.clock_ns_.store(std::int64_t{clock.sec()} * 1'000'000'000 + clock.nanosec());
    count_.fetch_add(1);
    node_.book_->arrivals()->notify();
  }
  [[nodiscard]] std::uint64_t count() const { return count_.load(); }

 private:
  NodeImpl& node_;
  std::atomic<std::uint64_t> count_{0};
  std::unique_ptr<Reader> reader_;
};

NodeImpl::NodeImpl(NodeOptions options)
    : options_(std::move(options)), restarts_(restarts_from_environment()), log_(options_.name) {}

Result<std::unique_ptr<NodeImpl>> NodeImpl::make(NodeOptions options) {
  if (options.name.empty() || !check_port_name("/" + options.name)) {
    return Error{ErrorCode::kInvalidArgument,
                 "node name '" + options.name + "' is not allowed: letters, digits and '_' make a name"};
  }
  if (!(options.period_s >= 0.0001 && options.period_s <= 3600)) {
    return Error{ErrorCode::kInvalidArgument, "period_s of node " + options.name + " is " +
                                                  std::to_string(options.period_s) +
                                                  ", allowed is 0.0001 to 3600"};
  }
  std::unique_ptr<NodeImpl> self(new NodeImpl(std::move(options)));
  if (auto status = self->open(); !status) {
    return status.error();
  }
  return self;
}

Status NodeImpl::open() {
  if (options_.handle_signals) {
    watch_ = std::make_unique<ProcessWatch>([this] { stop(); });
  }
  auto lock = NameLock::take(options_.domain, "node", options_.name);
  if (!lock) {
    return lock.error();
  }
  lock_ = std::move(lock).value();
  // In lockstep nobody may be forgotten because the machine was too busy for it: messages to it would be
  // missing. Who has died there is known by its name's socket.
  const int lease_s = options_.clock == ClockMode::kLockstep ? kLockstepLease_s : kLease_s;
  auto participant = Participant::join(options_.domain, options_.name, lease_s);
  if (!participant) {
    return participant.error();
  }
  participant_ = std::move(participant).value();
  participant_->watch(book_->changes());
  participant_->watch(book_->arrivals());

  const auto make_writer = [&](const std::string& topic, const MessageType& type, const Quality& quality,
                               std::unique_ptr<Writer>& place) -> Status {
    auto writer = Writer::open(participant_, topic, type, quality, "");
    if (!writer) {
      return writer.error();
    }
    place = std::move(writer).value();
    return {};
  };
  if (!options_.hidden) {
    Quality event;
    event.depth = 100;
    event.profile = to_string(Profile::kEvent);
    if (auto status = make_writer("rt/log", message_type_of<msgs::Log>(), event, log_writer_); !status) {
      return status;
    }
    Quality state = last_one();
    state.profile = to_string(Profile::kState);
    if (auto status = make_writer("rt/nido/nodes", message_type_of<msgs::NodeInfo>(), state, info_writer_);
        !status) {
      return status;
    }
    auto control = TextService::open(participant_, book_, "/" + options_.name + "/control",
                                     [this](const std::string& command) { return this->control(command); });
    if (!control) {
      return control.error();
    }
    control_ = std::move(control).value();
  }
  if (options_.clock == ClockMode::kSimulated) {
    clock_reader_ = std::make_unique<ClockReader>(*this);
    if (auto status = clock_reader_->open(); !status) {
      return status;
    }
  }
  housekeeper_ = std::thread([this] { keep_house(); });
  return {};
}

NodeImpl::~NodeImpl() {
  set_state("stopping", "");
  stopped_.store(true);
  closing_.store(true);
  book_->notify();
  if (housekeeper_.joinable()) {
    housekeeper_.join();
  }
  control_.reset();
  {
    const std::lock_guard lock(mutex_);
    clients_.clear();
  }
}

Time NodeImpl::now() const {
  if (options_.clock == ClockMode::kWall && !owns_clock_.load()) {
    return wall_now();
  }
  return {clock_ns_.load()};
}

Result<std::unique_ptr<RawOutput>> NodeImpl::open_raw_output(const std::string& port_name,
                                                             const MessageType& type, Profile profile,
                                                             std::size_t depth) {
  return OutputPort::open(participant_, book_, port_name, type, profile, depth,
                          options_.clock == ClockMode::kLockstep);
}

Result<std::unique_ptr<RawInput>> NodeImpl::open_raw_input(const std::string& port_name,
                                                           const MessageType& type, Profile profile,
                                                           std::size_t depth) {
  auto port = InputPort::open(participant_, book_, port_name, type, profile, depth,
                              options_.clock == ClockMode::kLockstep);
  if (!port) {
    return port;
  }
  for (const auto& [output, input] : options_.connections) {
    if (input == port_name) {
      if (auto status = (*port)->connect(output); !status) {
        return status.error();
      }
    }
  }
  return port;
}

Result<std::unique_ptr<Node::Service>> NodeImpl::open_service(
    const std::string& port_name, std::function<std::string(const std::string&)> handler) {
  auto service = TextService::open(participant_, book_, port_name, std::move(handler));
  if (!service) {
    return service.error();
  }
  return std::unique_ptr<Service>(std::move(service).value());
}

Result<std::string> NodeImpl::call(const std::string& port_name, const std::string& text, double timeout_s) {
  std::shared_ptr<TextClient> client;
  {
    const std::lock_guard lock(mutex_);
    client = clients_[port_name];
    if (!client) {
      auto fresh = TextClient::open(participant_, port_name);
      if (!fresh) {
        clients_.erase(port_name);
        return fresh.error();
      }
      client = clients_[port_name] = std::move(fresh).value();
    }
  }
  // a node that was asked to stop already may still say goodbye
  const bool is_parting = is_stopped();
  return client->call(text, is_parting ? std::min(timeout_s, kParting_s) : timeout_s,
                      [&] { return !is_parting && is_stopped(); });
}

void NodeImpl::set_state(const std::string& state, const std::string& detail) {
  {
    const std::lock_guard lock(mutex_);
    state_ = state;
    detail_ = detail;
  }
  book_->changes()->notify();
}

void NodeImpl::set_failed(const std::string& sentence) {
  log_error(sentence);
  set_state("failed", sentence);
}

void NodeImpl::stop() {
  stopped_.store(true);
  book_->notify();
}

Error NodeImpl::interrupted() const {
  return {ErrorCode::kInterrupted, "node " + options_.name + " was asked to stop"};
}

void NodeImpl::log(NodeLog::Level level, const std::string& text) {
  log_.add(now(), level, text);
  book_->changes()->notify();
}

Status NodeImpl::run(const std::function<Status(Time)>& on_tick) {
  tell_unused_parameters();
  switch (options_.clock) {
    case ClockMode::kWall:
      return run_on_wall(on_tick);
    case ClockMode::kSimulated:
      return run_on_clock(on_tick);
    case ClockMode::kLockstep:
      return run_in_lockstep(on_tick);
  }
  return {};
}

Status NodeImpl::run_on_wall(const std::function<Status(Time)>& on_tick) {
  const std::chrono::nanoseconds period(period_ns(options_));
  auto due = Steady::now();
  while (!is_stopped()) {
    if (auto status = on_tick(now()); !status) {
      return status;
    }
    // periods that are over already are left out
    due += period;
    const auto wall = Steady::now();
    if (due < wall) {
      due += (wall - due) / period * period;
    }
    while (!is_stopped()) {
      const std::uint64_t seen = book_->arrivals()->count();
      if (is_stopped() || !book_->arrivals()->wait_until(seen, due)) {
        break;
      }
    }
  }
  return {};
}

Status NodeImpl::run_on_clock(const std::function<Status(Time)>& on_tick) {
  Rhythm rhythm(period_ns(options_));
  std::uint64_t seen = 0;
  for (;;) {
    const auto has_ticked = [&] { return is_stopped() || clock_reader_->count() != seen; };
    while (!book_->arrivals()->wait(has_ticked, 3600.0)) {
    }
    if (is_stopped()) {
      return {};
    }
    seen = clock_reader_->count();
    const Time time = now();
    if (rhythm.is_due(time)) {
      if (auto status = on_tick(time); !status) {
        return status;
      }
    }
  }
}

LockstepContext NodeImpl::lockstep_context() {
  const auto network = network_settings_from_environment();
  const bool one_computer = network.ok() && !network->has_value();
  return {participant_,
          book_,
          options_.name,
          one_computer,
          [this] { return is_stopped(); },
          [this](const std::string& text) { log_info(text); },
          [this](const std::string& text) { log_warning(text); }};
}

Status NodeImpl::run_in_lockstep(const std::function<Status(Time)>& on_tick) {
  auto member = LockstepMember::open(lockstep_context());
  if (!member) {
    return member.error();
  }
  Rhythm rhythm(period_ns(options_));
  while (const auto start = (*member)->next()) {
    if (auto status = (*member)->prepare(); !status) {
      return is_stopped() ? Status() : status;
    }
    if (rhythm.is_due(start->time)) {
      clock_ns_.store(start->time.ns);
      (*member)->hand_out();
      if (auto status = on_tick(start->time); !status) {
        return status;
      }
    }
    (*member)->finish(start->tick);
  }
  // what came after the last tick can be taken, too
  book_->each_input([](InputRecord& port) {
    port.aim({});
    port.release(false);
  });
  return {};
}

Status NodeImpl::publish_clock(Time time) {
  if (is_stopped()) {
    return interrupted();
  }
  if (!owns_clock_.load()) {
    if (options_.clock == ClockMode::kSimulated) {
      return Error{ErrorCode::kInvalidArgument,
                   "node " + options_.name +
                       " follows /clock and cannot publish it; give it clock wall, or "
                       "lockstep for a barrier"};
    }
    // a port like any other: who reads it in lockstep gets every tick
    auto port = OutputPort::open(participant_, book_, "/clock", message_type_of<msgs::Clock>(),
                                 Profile::kState, 1, options_.clock == ClockMode::kLockstep);
    if (!port) {
      return port.error();
    }
    clock_port_ = std::move(port).value();
    if (options_.clock == ClockMode::kLockstep) {
      const auto nodes = parameter<std::vector<std::string>>("lockstep.nodes", {});
      if (!nodes) {
        return nodes.error();
      }
      // wall time; 0: no limit, for work with a debugger
      const auto patience_s = parameter<double>("lockstep.patience_s", 60.0);
      if (!patience_s) {
        return patience_s.error();
      }
      auto owner = LockstepOwner::open(lockstep_context(), *nodes, *patience_s);
      if (!owner) {
        return owner.error();
      }
      lockstep_owner_ = std::move(owner).value();
    }
    owns_clock_.store(true);
  }
  clock_ns_.store(time.ns);
  msgs::Clock clock;
  clock.clock(to_message(time));
  // one that does not get through is made up for by the next
  (void)clock_port_->write(&clock);
  if (lockstep_owner_) {
    if (auto status = lockstep_owner_->tick(time); !status) {
      return status;
    }
  }
  return is_stopped() ? Status(interrupted()) : Status();
}

}  // namespace nido
