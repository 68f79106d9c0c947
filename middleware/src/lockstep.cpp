#include "lockstep.h"

#include <algorithm>
#include <chrono>
#include <limits>

#include "name_lock.h"
#include "nido/middleware/port_name.h"
#include "nido/middleware/typed_port.h"
#include "output_port.h"

namespace nido {

namespace {

constexpr const char* kTickTopic = "rt/nido/tick";
constexpr const char* kDoneTopic = "rt/nido/tick_done";
constexpr std::uint64_t kLeaves = std::numeric_limits<std::uint64_t>::max();

// The protocol sends again what was lost on the way, so this long means a fault.
constexpr double kMessagePatience_s = 30.0;
// that readers outside the lockstep are waited for before the first tick
constexpr double kOutsiderPatience_s = 3.0;
// that is said when the end of a tick is waited for
constexpr double kFirstReport_s = 2.0;

using Steady = std::chrono::steady_clock;

Quality barrier_quality(int depth) {
  Quality quality;
  // the other side may appear later than the message
  quality.transient_local = true;
  quality.depth = depth;
  return quality;
}

// entries of a join: "/a:o" is an output; "/b:i</a:o" a connection that an input wants, 1 if its source is
// there;
// "/a:o>/b:i" a reader that an output has
std::string wanted_entry(const Wire& wire) { return wire.input + "<" + wire.output; }
std::string reader_entry(const Wire& wire) { return wire.output + ">" + wire.input; }

Sequences outputs_of(PortBook& book) {
  Sequences written;
  book.each_output([&](OutputRecord& port) { written[port.name()] = port.written(); });
  return written;
}

Sequences join_of(PortBook& book) {
  Sequences join;
  book.each_output([&](OutputRecord& port) {
    join[port.name()] = port.written();
    for (const Wire& wire : port.wires()) {
      join[reader_entry(wire)] = 1;
    }
  });
  book.each_input([&](InputRecord& port) {
    for (const Wire& wire : port.wires()) {
      join[wanted_entry(wire)] = wire.live ? 1 : 0;
    }
  });
  return join;
}

bool is_port(const std::string& entry) { return entry.find_first_of("<>") == std::string::npos; }

std::vector<msgs::PortSequence> pack(const Sequences& sequences) {
  std::vector<msgs::PortSequence> packed(sequences.size());
  auto place = packed.begin();
  for (const auto& [port, sequence] : sequences) {
    place->port(port);
    place->sequence(sequence);
    ++place;
  }
  return packed;
}

void unpack_into(std::vector<msgs::PortSequence>& packed, Sequences& sequences) {
  for (msgs::PortSequence& entry : packed) {
    sequences[std::move(entry.port())] = entry.sequence();
  }
}

}  // namespace

Status wait_for_inputs(const LockstepContext& context, const Sequences& written) {
  context.book->each_input([&](InputRecord& port) { port.aim(written); });
  const auto arrived = [&] {
    bool all = true;
    context.book->each_input([&](InputRecord& port) { all = all && port.arrived(); });
    return all || context.is_stopped();
  };
  const bool all = context.book->arrivals()->wait(arrived, kMessagePatience_s);
  if (context.is_stopped()) {
    return Error{ErrorCode::kInterrupted, "node " + context.node + " was asked to stop"};
  }
  if (!all) {
    std::string missing;
    context.book->each_input([&](InputRecord& port) {
      const std::string text = port.missing();
      missing += (missing.empty() || text.empty() ? "" : ", ") + text;
    });
    return Error{ErrorCode::kTimeout, "the lockstep waits for messages that do not arrive: " + missing};
  }
  return {};
}

namespace {

void release_inputs(const LockstepContext& context, bool is_first) {
  context.book->each_input([&](InputRecord& port) { port.release(is_first); });
}

void begin_tick(const LockstepContext& context) {
  context.book->each_output([](OutputRecord& port) { port.begin_tick(); });
}

}  // namespace

Result<std::unique_ptr<LockstepMember>> LockstepMember::open(LockstepContext context) {
  std::unique_ptr<LockstepMember> self(new LockstepMember(std::move(context)));
  auto writer = Writer::open(self->context_.participant, kDoneTopic, message_type_of<msgs::TickDone>(),
                             barrier_quality(4), "");
  if (!writer) {
    return writer.error();
  }
  self->done_writer_ = std::move(writer).value();
  auto reader = Reader::open(self->context_.participant, kTickTopic, message_type_of<msgs::Tick>(),
                             barrier_quality(4), "", *self);
  if (!reader) {
    return reader.error();
  }
  self->tick_reader_ = std::move(reader).value();
  return self;
}

LockstepMember::~LockstepMember() {
  if (!joined_with_.empty() || last_tick_ > 0) {
    send(kLeaves, {});
    // the message goes another way than the news that this process has ended, and may not be overtaken
    done_writer_->wait_until_received(0.2);
  }
}

void LockstepMember::on_message(std::shared_ptr<void> message, const MessageInfo& info) {
  {
    const std::lock_guard lock(mutex_);
    if (!is_new_(info)) {
      return;
    }
    ticks_.push_back(std::move(message));
    // an owner that counts this member waits for it; one that does not is only interesting for its newest
    // tick
    if (ticks_.size() > 4) {
      ticks_.erase(ticks_.begin());
    }
  }
  context_.book->arrivals()->notify();
}

void LockstepMember::send(std::uint64_t tick, const Sequences& written) {
  msgs::TickDone done;
  done.node(context_.node);
  done.tick(tick);
  done.written(pack(written));
  done_writer_->write(&done);
}

void LockstepMember::join() {
  Sequences join = join_of(*context_.book);
  join.emplace("", 0);  // also a node without ports has something to say
  if (join != joined_with_) {
    send(0, join);
    joined_with_ = std::move(join);
  }
}

std::optional<LockstepMember::TickStart> LockstepMember::next() {
  std::shared_ptr<void> message;
  const auto tick_is_there = [&] {
    {
      const std::lock_guard lock(mutex_);
      if (!ticks_.empty()) {
        message = std::move(ticks_.front());
        ticks_.erase(ticks_.begin());
      }
    }
    if (!message && last_tick_ == 0) {
      join();
    }
    return message || context_.is_stopped();
  };
  while (!context_.book->arrivals()->wait(tick_is_there, 3600.0)) {
  }
  if (context_.is_stopped()) {
    return std::nullopt;
  }
  auto& tick = *static_cast<msgs::Tick*>(message.get());
  if (tick.tick() == 1) {
    written_.clear();
  }
  unpack_into(tick.written(), written_);
  last_tick_ = tick.tick();
  return TickStart{tick.tick(),
                   Time{std::int64_t{tick.time().sec()} * 1'000'000'000 + tick.time().nanosec()}};
}

void LockstepMember::hand_out() { release_inputs(context_, last_tick_ == 1); }

void LockstepMember::finish(std::uint64_t tick) {
  begin_tick(context_);
  // only what is new
  Sequences outputs = outputs_of(*context_.book);
  Sequences fresh;
  for (const auto& [port, sequence] : outputs) {
    const auto known = told_.find(port);
    if (known == told_.end() || known->second != sequence) {
      fresh[port] = sequence;
    }
  }
  told_ = std::move(outputs);
  send(tick, fresh);
}

Result<std::unique_ptr<LockstepOwner>> LockstepOwner::open(LockstepContext context,
                                                           std::vector<std::string> expected,
                                                           double patience_s) {
  std::unique_ptr<LockstepOwner> self(new LockstepOwner(std::move(context), std::move(expected), patience_s));
  auto writer = Writer::open(self->context_.participant, kTickTopic, message_type_of<msgs::Tick>(),
                             barrier_quality(1), "");
  if (!writer) {
    return writer.error();
  }
  self->tick_writer_ = std::move(writer).value();
  auto reader = Reader::open(self->context_.participant, kDoneTopic, message_type_of<msgs::TickDone>(),
                             barrier_quality(64), "", *self);
  if (!reader) {
    return reader.error();
  }
  self->done_reader_ = std::move(reader).value();
  return self;
}

LockstepOwner::~LockstepOwner() { done_reader_.reset(); }

void LockstepOwner::on_message(std::shared_ptr<void> message, const MessageInfo& info) {
  bool tell = true;
  {
    auto& done = *static_cast<msgs::TickDone*>(message.get());
    const std::lock_guard lock(mutex_);
    if (!is_new_(info)) {
      return;
    }
    if (done.tick() == kLeaves) {
      members_.erase(done.node());
    } else {
      Member& member = members_[done.node()];
      if (done.tick() == 0) {
        // one that has worked already was started again; the others only tell more about their connections
        if (member.done > 0) {
          member.active = false;
          member.done = 0;
        }
        member.join.clear();
        unpack_into(done.written(), member.join);
        for (const auto& [entry, sequence] : member.join) {
          if (!entry.empty() && is_port(entry)) {
            written_[entry] = sequence;
          }
        }
        has_newcomer_ = true;
      } else {
        member.done = std::max(member.done, done.tick());
        unpack_into(done.written(), written_);
        // the tick is awaited by its last member only
        tell = std::all_of(members_.begin(), members_.end(), [&](const auto& entry) {
          return !entry.second.active || entry.second.done >= member.done;
        });
      }
    }
  }
  if (tell) {
    context_.book->arrivals()->notify();
  }
}

LockstepOwner::Obstacle LockstepOwner::obstacle() {
  const Sequences own = join_of(*context_.book);
  const auto endpoints = context_.participant->endpoints();
  Obstacle obstacle;
  const auto add = [](std::string& text, const std::string& part) {
    text += (text.empty() ? "" : "; ") + part;
  };
  const std::lock_guard lock(mutex_);
  for (const std::string& name : expected_) {
    if (!members_.contains(name)) {
      add(obstacle.absent, "node " + name + " is not there");
    }
  }
  // both ends of every connection between members must know each other
  std::set<std::string> known;
  std::map<std::string, std::string> outputs;  // by topic
  std::map<std::string, std::uint64_t> wanted;
  const auto note = [&](const Sequences& join) {
    for (const auto& [entry, value] : join) {
      if (entry.find('<') != std::string::npos) {
        wanted[entry] = value;
      } else if (entry.find('>') != std::string::npos) {
        known.insert(entry);
      } else if (!entry.empty()) {
        outputs[topic_of(entry)] = entry;
      }
    }
  };
  note(own);
  for (const auto& [name, member] : members_) {
    note(member.join);
  }
  std::set<std::string> inside;  // inputs
  for (const auto& [entry, live] : wanted) {
    const auto split = entry.find('<');
    const Wire wire{entry.substr(split + 1), entry.substr(0, split), live != 0};
    inside.insert(wire.input);
    if (outputs.contains(topic_of(wire.output)) && (!wire.live || !known.contains(reader_entry(wire)))) {
      add(obstacle.unconnected, wire.input + " is not connected to " + wire.output + " yet");
    }
  }
  // those outside are seen by discovery only
  for (const EndpointInfo& reader : endpoints) {
    const auto output = outputs.find(reader.topic);
    if (reader.is_writer || reader.port.empty() || output == outputs.end() || inside.contains(reader.port) ||
        known.contains(reader_entry({output->second, reader.port, true}))) {
      continue;
    }
    const bool fits = std::any_of(endpoints.begin(), endpoints.end(), [&](const EndpointInfo& writer) {
      return writer.is_writer && writer.topic == reader.topic && misfit(writer, reader).empty();
    });
    if (fits) {
      add(obstacle.unseen, output->second + " does not know of " + reader.port + " yet");
    }
  }
  return obstacle;
}

Status LockstepOwner::wait_for_members() {
  const auto seconds_since = [](Steady::time_point begin) {
    return std::chrono::duration<double>(Steady::now() - begin).count();
  };
  const Error stopped{ErrorCode::kInterrupted, "node " + context_.node + " was asked to stop"};
  double report_s = kFirstReport_s;
  Obstacle left;
  bool all_there = false;
  bool all_connected = false;
  Steady::time_point there_since;
  Steady::time_point connected_since;
  for (;;) {
    const auto is_ready = [&] {
      left = obstacle();
      return (left.absent.empty() && left.unconnected.empty() && left.unseen.empty()) ||
             context_.is_stopped();
    };
    const bool ready = context_.book->arrivals()->wait(is_ready, all_connected ? 0.1 : report_s);
    if (context_.is_stopped()) {
      return stopped;
    }
    if (ready) {
      return {};
    }
    if (left.absent.empty() && !all_there) {
      all_there = true;
      there_since = Steady::now();
    }
    if (left.absent.empty() && left.unconnected.empty()) {
      if (!all_connected) {
        all_connected = true;
        connected_since = Steady::now();
      }
      if (seconds_since(connected_since) > kOutsiderPatience_s) {
        context_.info("starts although " + left.unseen);
        return {};
      }
      continue;
    }
    all_connected = false;
    const std::string reason =
        left.absent + (left.absent.empty() || left.unconnected.empty() ? "" : "; ") + left.unconnected;
    if (all_there && patience_s_ > 0 && seconds_since(there_since) > patience_s_) {
      return Error{ErrorCode::kTimeout, "the first tick of the lockstep was waited for too long: " + reason};
    }
    context_.info("waits with the first tick: " + reason);
    report_s = 5.0;
  }
}

void LockstepOwner::drop_dead(std::uint64_t tick) {
  std::vector<std::string> late;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [name, member] : members_) {
      if (member.active && member.done < tick) {
        late.push_back(name);
      }
    }
  }
  const auto endpoints =
      context_.one_computer ? std::vector<EndpointInfo>() : context_.participant->endpoints();
  for (const std::string& name : late) {
    // a name of another computer is not owned on this one; there the lease tells
    const bool is_elsewhere =
        std::any_of(endpoints.begin(), endpoints.end(),
                    [&](const EndpointInfo& endpoint) { return endpoint.node == name; });
    if (!is_elsewhere && !NameLock::is_owned(context_.participant->domain(), "node", name)) {
      context_.warning("node " + name + " ended without leaving the lockstep; the run goes on without it");
      const std::lock_guard lock(mutex_);
      members_.erase(name);
    }
  }
}

Status LockstepOwner::tick(Time now) {
  if (tick_ == 0) {
    if (auto status = wait_for_members(); !status) {
      return status;
    }
  }
  ++tick_;
  begin_tick(context_);
  const Sequences own = outputs_of(*context_.book);
  msgs::Tick message;
  message.tick(tick_);
  message.time().sec(static_cast<std::int32_t>(now.ns / 1'000'000'000));
  message.time().nanosec(static_cast<std::uint32_t>(now.ns % 1'000'000'000));
  Sequences all;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [port, sequence] : own) {
      written_[port] = sequence;
    }
    for (auto& [name, member] : members_) {
      member.active = true;
    }
    // a newcomer must be told everything, the others only what is new
    Sequences fresh;
    for (const auto& [port, sequence] : written_) {
      const auto known = told_.find(port);
      if (has_newcomer_ || known == told_.end() || known->second != sequence) {
        fresh[port] = sequence;
      }
    }
    has_newcomer_ = false;
    told_ = written_;
    message.written(pack(fresh));
  }
  tick_writer_->write(&message);

  const auto begin = Steady::now();
  double next_report_s = kFirstReport_s;
  std::string waiting_for;
  const auto all_done = [&] {
    const std::lock_guard lock(mutex_);
    waiting_for.clear();
    for (const auto& [name, member] : members_) {
      if (member.active && member.done < tick_) {
        waiting_for += (waiting_for.empty() ? "" : ", ") + name;
      }
    }
    return waiting_for.empty() || context_.is_stopped();
  };
  while (!context_.book->arrivals()->wait(all_done, 0.25)) {
    drop_dead(tick_);
    const double waited_s = std::chrono::duration<double>(Steady::now() - begin).count();
    if (patience_s_ > 0 && waited_s > patience_s_ && !all_done()) {
      return Error{ErrorCode::kTimeout, "the lockstep waited " + std::to_string(static_cast<int>(waited_s)) +
                                            " s for node " + waiting_for +
                                            ", which lives but has not finished tick " +
                                            std::to_string(tick_) + " (" + std::to_string(now.seconds()) +
                                            " s); parameter lockstep.patience_s is the limit"};
    }
    if (waited_s > next_report_s) {
      context_.info("waits since " + std::to_string(static_cast<int>(waited_s)) + " s for " + waiting_for);
      next_report_s *= 2;
    }
  }
  if (context_.is_stopped()) {
    return Error{ErrorCode::kInterrupted, "node " + context_.node + " was asked to stop"};
  }
  {
    const std::lock_guard lock(mutex_);
    all = written_;
  }
  if (auto status = wait_for_inputs(context_, all); !status) {
    return status;
  }
  release_inputs(context_, tick_ == 1);
  return {};
}

}  // namespace nido
