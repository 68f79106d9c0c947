#include "lockstep.h"

#include <algorithm>
#include <chrono>
#include <limits>

#include "name_lock.h"
#include "nido/middleware/typed_port.h"

namespace nido {

namespace {

constexpr const char* kTickTopic = "rt/nido/tick";
constexpr const char* kDoneTopic = "rt/nido/tick_done";
constexpr std::uint64_t kLeaves = std::numeric_limits<std::uint64_t>::max();

// The protocol sends again what was lost on the way, so this long means a fault: the run goes on, but is not
// repeatable.
constexpr double kPatience_s = 10.0;

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

bool collect_inputs(const LockstepContext& context, const Sequences& written) {
  context.book->each_input([&](InputRecord& port) { port.aim(written); });
  const auto arrived = [&] {
    bool all = true;
    context.book->each_input([&](InputRecord& port) { all = all && port.arrived(); });
    return all || context.is_stopped();
  };
  if (!context.book->arrivals()->wait(arrived, kPatience_s)) {
    std::string missing;
    context.book->each_input([&](InputRecord& port) {
      const std::string text = port.missing();
      missing += (missing.empty() || text.empty() ? "" : ", ") + text;
    });
    context.warning("went on without messages that did not arrive within 10 s: " + missing);
  }
  if (context.is_stopped()) {
    return false;
  }
  context.book->each_input([](InputRecord& port) { port.release(); });
  return true;
}

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
  }
}

void LockstepMember::on_message(std::shared_ptr<void> message, const MessageInfo& /*info*/) {
  {
    const std::lock_guard lock(mutex_);
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

void LockstepMember::finish(std::uint64_t tick) {
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
                                                           std::vector<std::string> expected) {
  std::unique_ptr<LockstepOwner> self(new LockstepOwner(std::move(context), std::move(expected)));
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

void LockstepOwner::on_message(std::shared_ptr<void> message, const MessageInfo& /*info*/) {
  bool tell = true;
  {
    auto& done = *static_cast<msgs::TickDone*>(message.get());
    const std::lock_guard lock(mutex_);
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

std::string LockstepOwner::obstacle() {
  const Sequences own = join_of(*context_.book);
  const std::lock_guard lock(mutex_);
  std::string text;
  const auto add = [&](const std::string& part) { text += (text.empty() ? "" : "; ") + part; };
  for (const std::string& name : expected_) {
    if (!members_.contains(name)) {
      add("node " + name + " is not there");
    }
  }
  // both ends of every connection between members must know each other
  std::set<std::string> known;
  std::set<std::string> outputs;
  std::map<std::string, std::uint64_t> wanted;
  const auto note = [&](const Sequences& join) {
    for (const auto& [entry, value] : join) {
      if (entry.find('<') != std::string::npos) {
        wanted[entry] = value;
      } else if (entry.find('>') != std::string::npos) {
        known.insert(entry);
      } else {
        outputs.insert(entry);
      }
    }
  };
  note(own);
  for (const auto& [name, member] : members_) {
    note(member.join);
  }
  for (const auto& [entry, live] : wanted) {
    const auto split = entry.find('<');
    const Wire wire{entry.substr(split + 1), entry.substr(0, split), live != 0};
    if (outputs.contains(wire.output) && (!wire.live || !known.contains(reader_entry(wire)))) {
      add(wire.input + " is not connected to " + wire.output + " yet");
    }
  }
  return text;
}

bool LockstepOwner::wait_for_members() {
  double patience_s = 2.0;
  for (;;) {
    std::string reason;
    const auto ready = [&] {
      reason = obstacle();
      return reason.empty() || context_.is_stopped();
    };
    if (context_.book->arrivals()->wait(ready, patience_s)) {
      return !context_.is_stopped();
    }
    context_.info("waits with the first tick: " + reason);
    patience_s = 5.0;
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
  for (const std::string& name : late) {
    if (!NameLock::is_owned(context_.participant->domain(), "node", name)) {
      context_.warning("node " + name + " ended without leaving the lockstep; the run goes on without it");
      const std::lock_guard lock(mutex_);
      members_.erase(name);
    }
  }
}

bool LockstepOwner::tick(Time now) {
  if (tick_ == 0 && !wait_for_members()) {
    return false;
  }
  ++tick_;
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
  double next_report_s = 2.0;
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
    if (waited_s > next_report_s) {
      context_.info("waits since " + std::to_string(static_cast<int>(waited_s)) + " s for " + waiting_for);
      next_report_s *= 2;
    }
  }
  if (context_.is_stopped()) {
    return false;
  }
  {
    const std::lock_guard lock(mutex_);
    all = written_;
  }
  return collect_inputs(context_, all);
}

}  // namespace nido
