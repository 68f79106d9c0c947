#include "input_port.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "nido/middleware/port_name.h"
#include "output_port.h"

namespace nido {

namespace {

// lockstep: messages of one source that wait for their tick; more than any pair of ticks brings
constexpr std::size_t kMostHeld = 4096;
// messages whose memory is kept for others
constexpr std::size_t kMostSpare = 4;

// the clock of source times
std::int64_t wall_now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}
// commands that a node has not taken yet. Many come at once when one before them was lost on the way and had
// to be sent again; as many as a sender keeps for a reader that is behind (endpoint_quality.cpp).
constexpr std::size_t kMostCommands = 2000;

}  // namespace

Result<std::unique_ptr<RawInput>> InputPort::open(std::shared_ptr<Participant> participant,
                                                  std::shared_ptr<PortBook> book, const std::string& name,
                                                  const MessageType& type, Profile profile, std::size_t depth,
                                                  bool lockstep) {
  if (auto status = check_port_name(name); !status) {
    return status.error();
  }
  std::unique_ptr<InputPort> self(new InputPort());
  self->name_ = name;
  self->type_ = type;
  self->profile_ = profile;
  self->depth_ = std::max<std::size_t>(depth, profile == Profile::kCommand ? kMostCommands : 1);
  self->lockstep_ = lockstep;
  self->participant_ = std::move(participant);
  auto lock = NameLock::take(self->participant_->domain(), "port", name);
  if (!lock) {
    return lock.error();
  }
  self->lock_ = std::move(lock).value();
  self->book_ = std::move(book);
  self->book_->enter(static_cast<InputRecord*>(self.get()));
  return std::unique_ptr<RawInput>(std::move(self));
}

InputPort::~InputPort() {
  if (book_) {
    book_->leave(static_cast<InputRecord*>(this));
  }
  // readers go without the lock, as a callback may be waiting for it
  for (auto& entry : connections_) {
    entry.second->reader_.reset();
  }
}

[[gnu::hot]] bool InputPort::Connection::note(const MessageInfo& info) {
  Stream& stream = streams_[info.writer];
  if (stream.last >= info.sequence) {
    return false;  // a repetition
  }
  if (stream.last > 0) {
    counters_.lost += info.sequence - stream.last - 1;
    gap_ += info.sequence - stream.last - 1;
  }
  stream.last = info.sequence;
  ++counters_.received;
  counters_.bytes += info.bytes;
  delay_log_.note(info.source_time_ns, wall_now_ns(), counters_);
  return true;
}

std::shared_ptr<void> InputPort::Connection::spare_message() {
  const std::lock_guard lock(port_.mutex_);
  if (port_.spare_.empty()) {
    return nullptr;
  }
  std::shared_ptr<void> message = std::move(port_.spare_.back());
  port_.spare_.pop_back();
  return message;
}

[[gnu::hot]] bool InputPort::Connection::on_payload(std::span<const std::uint8_t> payload,
                                                    const MessageInfo& info) {
  if (!port_.has_handler_.load()) {
    return false;
  }
  const std::lock_guard calls(port_.handler_mutex_);
  if (!port_.payload_handler_) {
    return false;
  }
  {
    const std::lock_guard lock(port_.mutex_);
    if (!note(info)) {
      return true;
    }
  }
  port_.payload_handler_(payload, arrival_of(info));
  return true;
}

void InputPort::Connection::on_message(std::shared_ptr<void> message, const MessageInfo& info) {
  bool tell = false;
  const bool is_handed_over = port_.has_handler_.load();
  {
    const std::lock_guard lock(port_.mutex_);
    if (!note(info)) {
      return;
    }
    if (!is_handed_over) {
      Item item{std::move(message), source_, Time{info.source_time_ns}, info.sequence, info.writer};
      if (port_.lockstep_) {
        held_.push_back(std::move(item));
        if (held_.size() > kMostHeld) {
          held_.pop_front();
          ++counters_.lost;
        }
        tell = target_ && info.sequence >= *target_;
      } else {
        port_.keep(*this, std::move(item));
      }
    }
  }
  if (is_handed_over) {
    port_.hand_over(std::move(message), arrival_of(info));
    return;
  }
  if (tell) {
    port_.book_->arrivals()->notify();
  }
  port_.changed_.notify();
}

void InputPort::hand_over(std::shared_ptr<void> message, const Arrival& arrival) {
  {
    const std::lock_guard calls(handler_mutex_);
    call_handler(message.get(), arrival);
  }
  reuse(std::move(message));
}

void InputPort::call_handler(void* message, const Arrival& arrival) {
  if (handler_) {
    handler_(message, arrival);
    return;
  }
  // it travelled in another way
  dds::TypeSupport support(type_.make_support());
  const std::uint32_t size = support->getSerializedSizeProvider(message)();
  eprosima::fastrtps::rtps::SerializedPayload_t payload(size);
  if (support->serialize(message, &payload)) {
    payload_handler_({payload.data, payload.length}, arrival);
  }
}

void InputPort::reuse(std::shared_ptr<void> message) {
  const std::lock_guard lock(mutex_);
  if (spare_.size() < kMostSpare) {
    spare_.push_back(std::move(message));
  }
}

Status InputPort::set_handlers(RawHandler handler, PayloadHandler payload_handler) {
  if (lockstep_) {
    return Error{ErrorCode::kUnsupported, "port " + name_ +
                                              " is in lockstep, where messages belong to ticks: take them in "
                                              "run(), a handler is not called"};
  }
  const std::lock_guard calls(handler_mutex_);
  if (handler_ || payload_handler_) {
    return Error{ErrorCode::kInvalidArgument, "port " + name_ + " has a handler already"};
  }
  handler_ = std::move(handler);
  payload_handler_ = std::move(payload_handler);
  has_handler_.store(true);
  // what came before, first
  for (;;) {
    std::optional<Item> early;
    {
      const std::lock_guard lock(mutex_);
      if (ready_.empty()) {
        return {};
      }
      early = std::move(ready_.front());
      ready_.pop_front();
    }
    call_handler(early->message.get(), {*early->source, early->source_time, early->sequence});
  }
}

bool InputPort::swap_latest(const std::function<void(void* message)>& swap) {
  std::shared_ptr<void> message;
  {
    const std::lock_guard lock(mutex_);
    if (ready_.empty()) {
      return false;
    }
    while (ready_.size() > 1) {
      drop_oldest();
    }
    message = std::move(ready_.front().message);
    ready_.pop_front();
  }
  swap(message.get());
  reuse(std::move(message));
  return true;
}

void InputPort::Connection::on_matched(const Guid& writer, bool matched) {
  {
    const std::lock_guard lock(port_.mutex_);
    if (matched) {
      streams_[writer].live = true;
      newest_writer_ = writer;
      was_interrupted_ |= !known_writers_.insert(writer).second;
    } else {
      streams_.erase(writer);
      if (newest_writer_ == writer) {
        newest_writer_ = streams_.empty() ? Guid() : streams_.begin()->first;
      }
    }
    counters_.live = !streams_.empty();
  }
  port_.changed_.notify();
  port_.book_->notify();
}

void InputPort::drop_oldest() {
  if (spare_.size() < kMostSpare) {
    spare_.push_back(std::move(ready_.front().message));
  }
  ready_.pop_front();
}

void InputPort::keep(Connection& connection, Item item) {
  // the bound holds for the queue as a whole: whoever floods it pushes out the oldest, and that one counts as
  // lost
  ready_.push_back(std::move(item));
  if (ready_.size() > depth_) {
    const auto owner = connections_.find(*ready_.front().source);
    ++(owner != connections_.end() ? owner->second->counters_.lost : connection.counters_.lost);
    drop_oldest();
  }
}

std::optional<RawReceived> InputPort::take() {
  const std::lock_guard lock(mutex_);
  if (ready_.empty()) {
    return std::nullopt;
  }
  RawReceived received = ready_.front().to_user();
  ready_.pop_front();
  return received;
}

std::optional<RawReceived> InputPort::take_latest() {
  const std::lock_guard lock(mutex_);
  if (ready_.empty()) {
    return std::nullopt;
  }
  RawReceived received = ready_.back().to_user();
  ready_.clear();
  return received;
}

bool InputPort::wait_for_message(double timeout_s) {
  return changed_.wait(
      [&] {
        const std::lock_guard lock(mutex_);
        return !ready_.empty();
      },
      timeout_s);
}

bool InputPort::wait_for_sources(std::size_t count, double timeout_s) {
  return changed_.wait(
      [&] {
        const std::lock_guard lock(mutex_);
        return static_cast<std::size_t>(
                   std::count_if(connections_.begin(), connections_.end(),
                                 [](const auto& entry) { return entry.second->counters_.live; })) >= count;
      },
      timeout_s);
}

EndpointInfo InputPort::own_info() const {
  const Quality quality = Quality::of(profile_, depth_, false, lockstep_, participant_->repairs_pictures());
  EndpointInfo info;
  info.dds_type = type_.dds_name;
  info.node = participant_->node_name();
  info.port = name_;
  info.profile = quality.profile;
  info.reliable = quality.reliable || quality.repaired;
  info.transient_local = quality.transient_local;
  return info;
}

Status InputPort::connect(const std::string& output_name) {
  if (auto status = check_port_name(output_name); !status) {
    return status.error();
  }
  const std::lock_guard wiring(wiring_mutex_);
  {
    const std::lock_guard lock(mutex_);
    if (connections_.contains(output_name)) {
      return {};
    }
  }
  for (const auto& [guid, info] : participant_->writers_of(topic_of(output_name))) {
    if (const std::string why = misfit(info, own_info()); !why.empty()) {
      return Error{ErrorCode::kInvalidArgument, why};
    }
  }
  auto fresh = std::make_unique<Connection>(*this, output_name);
  Connection& connection = *fresh;
  {
    const std::lock_guard lock(mutex_);
    connections_[output_name] = std::move(fresh);
  }
  auto reader = Reader::open(
      participant_, topic_of(output_name), type_,
      Quality::of(profile_, depth_, false, lockstep_, participant_->repairs_pictures()), name_, connection);
  if (!reader) {
    const std::lock_guard lock(mutex_);
    connections_.erase(output_name);
    return reader.error();
  }
  // callbacks do not look at reader_
  connection.reader_ = std::move(reader).value();
  book_->notify();
  return {};
}

Status InputPort::disconnect(const std::string& output_name) {
  const std::lock_guard wiring(wiring_mutex_);
  std::unique_ptr<Reader> reader;
  {
    const std::lock_guard lock(mutex_);
    const auto found = connections_.find(output_name);
    if (found == connections_.end()) {
      return Error{ErrorCode::kNotFound, "port " + name_ + " is not connected to " + output_name};
    }
    reader = std::move(found->second->reader_);
  }
  // without the lock: a callback may be waiting for it
  reader.reset();
  {
    const std::lock_guard lock(mutex_);
    connections_.erase(output_name);
  }
  book_->notify();
  return {};
}

std::vector<ConnectionCounters> InputPort::connections() const {
  const std::lock_guard lock(mutex_);
  std::vector<ConnectionCounters> all;
  for (const auto& entry : connections_) {
    all.push_back(entry.second->counters_);
  }
  return all;
}

std::string InputPort::delays() const {
  const std::lock_guard lock(mutex_);
  std::string text;
  for (const auto& [source, connection] : connections_) {
    text += "\n" + source + " " + delay_text(connection->counters_);
  }
  return text;
}

PortDescription InputPort::describe() const {
  PortDescription description;
  description.name = name_;
  description.type = type_.ros_name();
  description.direction = "input";
  description.profile = to_string(profile_);
  const std::lock_guard lock(mutex_);
  for (const auto& entry : connections_) {
    description.connections.push_back(entry.second->counters_);
  }
  return description;
}

std::vector<std::string> InputPort::new_complaints() {
  std::vector<std::string> sources;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& entry : connections_) {
      sources.push_back(entry.first);
    }
  }
  std::vector<std::string> complaints;
  for (const std::string& source : sources) {
    for (const auto& [guid, info] : participant_->writers_of(topic_of(source))) {
      const std::string why = misfit(info, own_info());
      const std::lock_guard lock(mutex_);
      if (!why.empty() && complained_.insert(guid).second) {
        complaints.push_back(why);
      }
    }
  }
  if (!lockstep_) {
    return complaints;
  }
  const std::lock_guard lock(mutex_);
  for (const auto& [source, connection] : connections_) {
    if (const std::uint64_t lost = std::exchange(connection->gap_, 0); lost > 0) {
      complaints.push_back(name_ + " did not get " + std::to_string(lost) + " messages of " + source +
                           ": this run cannot be repeated");
    }
    if (std::exchange(connection->was_interrupted_, false)) {
      complaints.push_back(name_ + " lost sight of " + source +
                           " for a while, as when a process is stopped for a minute: messages may be "
                           "missing, this run cannot be repeated");
    }
  }
  return complaints;
}

std::vector<Wire> InputPort::wires() const {
  const std::lock_guard lock(mutex_);
  std::vector<Wire> wires;
  for (const auto& entry : connections_) {
    wires.push_back({entry.first, name_, entry.second->counters_.live});
  }
  return wires;
}

void InputPort::aim(const Sequences& written) {
  const std::lock_guard lock(mutex_);
  for (auto& entry : connections_) {
    const auto found = written.find(entry.first);
    entry.second->target_ = found == written.end() ? std::nullopt : std::optional(found->second);
  }
}

bool InputPort::has_arrived(const Connection& connection) const {
  if (!connection.target_ || *connection.target_ == 0) {
    return true;
  }
  const auto stream = connection.streams_.find(connection.newest_writer_);
  if (stream == connection.streams_.end() || !stream->second.live) {
    return true;  // the source is gone, or not there yet
  }
  if (stream->second.floor && *connection.target_ <= *stream->second.floor) {
    return true;
  }
  if (!stream->second.floor) {
    // what was written before this connection's first tick comes only from a port that keeps its last message
    const auto info = participant_->endpoint(connection.newest_writer_);
    if (profile_ != Profile::kState || !info || !info->transient_local) {
      return true;
    }
  }
  return stream->second.last >= *connection.target_;
}

bool InputPort::arrived() const {
  const std::lock_guard lock(mutex_);
  return std::all_of(connections_.begin(), connections_.end(),
                     [&](const auto& entry) { return has_arrived(*entry.second); });
}

std::string InputPort::missing() const {
  const std::lock_guard lock(mutex_);
  std::string text;
  for (const auto& entry : connections_) {
    if (!has_arrived(*entry.second)) {
      const auto stream = entry.second->streams_.find(entry.second->newest_writer_);
      const std::uint64_t last = stream == entry.second->streams_.end() ? 0 : stream->second.last;
      text += (text.empty() ? "" : ", ") + name_ + " has message " + std::to_string(last) + " of " +
              std::to_string(entry.second->target_.value_or(0)) + " from " + entry.first;
    }
  }
  return text;
}

void InputPort::release(bool is_first) {
  const std::lock_guard lock(mutex_);
  for (auto& entry : connections_) {
    Connection& connection = *entry.second;
    std::deque<Item> due;
    std::deque<Item> later;
    for (Item& item : connection.held_) {
      const bool is_bound = connection.target_ && item.writer == connection.newest_writer_;
      (is_bound && item.sequence > *connection.target_ ? later : due).push_back(std::move(item));
    }
    connection.held_ = std::move(later);
    // Until a writer knows of this port, whether a message reaches it is a matter of chance: only the last
    // one of a state port is sure, so only that one is handed out. A writer of which a message came knows.
    const auto stream = connection.streams_.find(connection.newest_writer_);
    if (connection.target_ && stream != connection.streams_.end() && stream->second.live &&
        !stream->second.floor) {
      if (is_first || stream->second.last > 0) {
        stream->second.floor = *connection.target_;
      }
      if (profile_ != Profile::kState) {
        due.clear();
      } else if (!due.empty()) {
        due.erase(due.begin(), due.end() - 1);
      }
    }
    for (Item& item : due) {
      keep(connection, std::move(item));
    }
  }
}

}  // namespace nido
