#include "output_port.h"

#include "nido/middleware/port_name.h"

namespace nido {

namespace {

std::string words_for(const EndpointInfo& end) {
  MessageType type;
  type.dds_name = end.dds_type;
  const std::string who =
      end.port.empty() ? "a port of another program" : end.port + " (node " + end.node + ")";
  return who + " with type " + type.ros_name() + (end.profile.empty() ? "" : " and profile " + end.profile);
}

}  // namespace

std::string misfit(const EndpointInfo& output, const EndpointInfo& input) {
  std::string why;
  std::string mend = "give both the same type and profile";
  if (output.dds_type != input.dds_type) {
    why = "the types differ";
  } else if (input.reliable && !output.reliable && input.profile == to_string(Profile::kSensor)) {
    why = "the input asks for what was lost of a picture, the output does not send it again";
    mend = "let the network files of both computers say repair_pictures, or none";
  } else if (input.reliable && !output.reliable) {
    why = "the input wants every message, the output may drop some";
  } else if (input.transient_local && !output.transient_local) {
    why = "the input wants the last message when it joins late, the output does not keep it";
  }
  if (why.empty()) {
    return why;
  }
  return words_for(output) + " cannot be connected to " + words_for(input) + ": " + why + "; " + mend;
}

Result<std::unique_ptr<RawOutput>> OutputPort::open(std::shared_ptr<Participant> participant,
                                                    std::shared_ptr<PortBook> book, const std::string& name,
                                                    const MessageType& type, Profile profile,
                                                    std::size_t depth, bool lockstep) {
  if (auto status = check_port_name(name); !status) {
    return status.error();
  }
  std::unique_ptr<OutputPort> self(new OutputPort());
  self->name_ = name;
  self->type_ = type;
  self->profile_ = profile;
  self->participant_ = std::move(participant);
  auto lock = NameLock::take(self->participant_->domain(), "port", name);
  if (!lock) {
    return lock.error();
  }
  self->lock_ = std::move(lock).value();
  const Quality quality = Quality::of(profile, depth, true, lockstep, self->participant_->repairs_pictures());
  if (lockstep && !quality.keep_all) {
    self->room_ = static_cast<std::uint64_t>(quality.depth) / 2;
  }
  auto writer = Writer::open(self->participant_, topic_of(name), type, quality, name);
  if (!writer) {
    return writer.error();
  }
  self->writer_ = std::move(writer).value();
  self->book_ = std::move(book);
  self->writer_->notify_also(self->book_->changes());
  self->writer_->notify_also(self->book_->arrivals());
  self->book_->enter(static_cast<OutputRecord*>(self.get()));
  return std::unique_ptr<RawOutput>(std::move(self));
}

OutputPort::~OutputPort() {
  if (book_) {
    book_->leave(static_cast<OutputRecord*>(this));
  }
}

void OutputPort::begin_tick() { tick_began_at_.store(writer_->written()); }

template <class Send>
Status OutputPort::send(const Send& send) {
  const std::uint64_t began_at = tick_began_at_.load();
  if (room_ && began_at != kNever && writer_->written() - began_at >= *room_) {
    return Error{ErrorCode::kFailed,
                 "port " + name_ + " has written " + std::to_string(*room_) +
                     " messages in one tick of the lockstep, and no more are kept for its "
                     "readers: open it with profile event and a larger depth"};
  }
  switch (send()) {
    case Sent::kYes:
      return {};
    case Sent::kNoRoom:
      return Error{ErrorCode::kTimeout,
                   "port " + name_ + " could not keep a message: a connected reader has not taken the last " +
                       (profile_ == Profile::kCommand ? "2000; is its process stopped?"
                                                      : "ones; is its process stopped?")};
    case Sent::kNoMemory:
      return Error{ErrorCode::kFailed,
                   "port " + name_ +
                       " could not send a message: the system gives this process no shared "
                       "memory or no more open files for it (ulimit -n)"};
    case Sent::kFailed:
      break;
  }
  return Error{ErrorCode::kFailed, "port " + name_ + " could not send a message: it is not whole"};
}

Status OutputPort::write(const void* message) {
  return send([&] { return writer_->write(message); });
}

[[gnu::hot]] Status OutputPort::write_loan(std::size_t bytes) {
  return send([&] { return writer_->write_loan(bytes); });
}

bool OutputPort::wait_for_readers(std::size_t count, double timeout_s) {
  return writer_->readers_signal()->wait([&] { return writer_->reader_count() >= count; }, timeout_s);
}

std::vector<Wire> OutputPort::wires() const {
  std::vector<Wire> wires;
  for (const Guid& reader : writer_->readers()) {
    const auto info = participant_->endpoint(reader);
    // what a node reads for itself, the clock say, has no name
    const std::string who = !info || info->node.empty() ? "another program"
                            : info->port.empty()        ? "node " + info->node
                                                        : info->port;
    wires.push_back({name_, who, true});
  }
  return wires;
}

PortDescription OutputPort::describe() const {
  PortDescription description;
  description.name = name_;
  description.type = type_.ros_name();
  description.direction = "output";
  description.profile = to_string(profile_);
  description.written = written();
  for (const Wire& wire : wires()) {
    description.connections.push_back({wire.input, true, 0, 0, 0});
  }
  return description;
}

}  // namespace nido
