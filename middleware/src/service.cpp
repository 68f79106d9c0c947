#include "service.h"

#include "nido/middleware/port_name.h"
#include "nido/middleware/typed_port.h"

namespace nido {

namespace {

// requests that wait for one service; more than that from people and tools is a fault
constexpr std::size_t kMostRequests = 1000;

Quality service_quality() {
  Quality quality;
  quality.depth = 64;
  quality.profile = "service";
  return quality;
}

}  // namespace

Result<std::unique_ptr<TextService>> TextService::open(
    std::shared_ptr<Participant> participant, std::shared_ptr<PortBook> book, const std::string& name,
    std::function<std::string(const std::string&)> handler) {
  if (auto status = check_port_name(name); !status) {
    return status.error();
  }
  std::unique_ptr<TextService> self(new TextService());
  self->name_ = name;
  self->participant_ = std::move(participant);
  self->handler_ = std::move(handler);
  auto lock = NameLock::take(self->participant_->domain(), "port", name);
  if (!lock) {
    return lock.error();
  }
  self->lock_ = std::move(lock).value();
  auto replies = Writer::open(self->participant_, reply_topic_of(name),
                              message_type_of<msgs::Text_Response>(), service_quality(), name);
  if (!replies) {
    return replies.error();
  }
  self->replies_ = std::move(replies).value();
  self->loop_ = std::make_shared<LaneLoop>();
  if (!self->loop_->is_running()) {
    return no_lanes(name);
  }
  auto reader =
      Reader::open(self->participant_, request_topic_of(name), message_type_of<msgs::Text_Request>(),
                   service_quality(), name, *self, self->loop_);
  if (!reader) {
    return reader.error();
  }
  self->reader_ = std::move(reader).value();
  self->book_ = std::move(book);
  self->book_->enter_service(self.get());
  return self;
}

TextService::~TextService() {
  if (book_) {
    book_->leave(this);
  }
  reader_.reset();
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  if (replies_) {
    replies_->readers_signal()->notify();
  }
  if (loop_) {
    loop_->stop();
  }
}

void TextService::on_message(std::shared_ptr<void> message, const MessageInfo& info) {
  Request request;
  request.text = std::move(static_cast<msgs::Text_Request*>(message.get())->text());
  // as ROS 2 does it: the client names the reader that waits for the reply; older ones only sign with their
  // writer
  request.id.writer_guid(info.related.writer_guid() == Guid::unknown() ? info.identity.writer_guid()
                                                                       : info.related.writer_guid());
  request.id.sequence_number(info.identity.sequence_number());
  {
    const std::lock_guard lock(mutex_);
    if (requests_.size() >= kMostRequests) {
      requests_.pop_front();
    }
    requests_.push_back(std::move(request));
  }
  // outside of this call, which nothing that a handler does may hold up
  loop_->post([this] { answer_requests(); });
}

void TextService::answer_requests() {
  for (;;) {
    Request request;
    {
      const std::lock_guard lock(mutex_);
      if (closing_ || requests_.empty()) {
        return;
      }
      request = std::move(requests_.front());
      requests_.pop_front();
    }
    msgs::Text_Response response;
    try {
      response.text(handler_(request.text));
    } catch (const std::exception& failure) {
      response.text(std::string("[fail] ") + failure.what());
    }
    // the client's reader may be discovered a little later than its request came
    const auto info = participant_->endpoint(request.id.writer_guid());
    if (!info || !info->is_writer) {
      replies_->readers_signal()->wait(
          [&] {
            const std::lock_guard lock(mutex_);
            return closing_ || replies_->readers().contains(request.id.writer_guid());
          },
          0.5);
    }
    replies_->write(&response, &request.id);
    answered_.fetch_add(1);
  }
}

PortDescription TextService::describe() const {
  PortDescription description;
  description.name = name_;
  description.type = "nido_msgs/srv/Text";
  description.direction = "service";
  description.written = answered_.load();
  return description;
}

Result<std::shared_ptr<TextClient>> TextClient::open(std::shared_ptr<Participant> participant,
                                                     const std::string& name) {
  if (auto status = check_port_name(name); !status) {
    return status.error();
  }
  std::shared_ptr<TextClient> self(new TextClient(name));
  self->participant_ = std::move(participant);
  auto requests = Writer::open(self->participant_, request_topic_of(name),
                               message_type_of<msgs::Text_Request>(), service_quality(), name);
  if (!requests) {
    return requests.error();
  }
  self->requests_ = std::move(requests).value();
  self->changed_ = self->requests_->readers_signal();
  auto reader = Reader::open(self->participant_, reply_topic_of(name), message_type_of<msgs::Text_Response>(),
                             service_quality(), name, *self);
  if (!reader) {
    return reader.error();
  }
  self->reader_ = std::move(reader).value();
  {
    const std::lock_guard lock(self->mutex_);
    self->reply_reader_ = self->reader_->guid();
  }
  return self;
}

TextClient::~TextClient() { reader_.reset(); }

bool TextClient::is_connected() const {
  if (requests_->reader_count() == 0) {
    return false;
  }
  const std::lock_guard lock(mutex_);
  return !servers_.empty();
}

Result<std::string> TextClient::call(const std::string& text, double timeout_s,
                                     const std::function<bool()>& interrupted) {
  const auto begin = std::chrono::steady_clock::now();
  const auto left_s = [&] {
    return timeout_s - std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  // waits in slices, so that a stop of the node is seen
  const auto wait = [&](const auto& holds) {
    for (double left = left_s(); left > 0 && !interrupted(); left = left_s()) {
      if (changed_->wait(holds, std::min(left, 0.1))) {
        return true;
      }
    }
    return static_cast<bool>(holds());
  };
  const Error stopped{ErrorCode::kInterrupted,
                      "the call to " + name_ + " was interrupted: this node was asked to stop"};

  if (!wait([&] { return is_connected(); })) {
    return interrupted() ? stopped
                         : Error{ErrorCode::kNotFound, "no port " + name_ + " appeared within " +
                                                           std::to_string(timeout_s) + " s in DDS domain " +
                                                           std::to_string(participant_->domain()) +
                                                           "; 'nido port list' shows those that are there"};
  }
  std::uint64_t sequence = 0;
  {
    const std::lock_guard call_lock(call_mutex_);
    msgs::Text_Request request;
    request.text(text);
    SampleId related;
    related.writer_guid(reply_reader_);
    {
      // the answer may be here before write() returns
      const std::lock_guard lock(mutex_);
      sequence = requests_->written() + 1;
      awaited_[{false, sequence}] = sequence;
      // a server of another program answers to the number that it has seen
      awaited_[{true, requests_->written_by_dds() + 1}] = sequence;
    }
    if (requests_->write(&request, &related) != Sent::kYes) {
      const std::lock_guard lock(mutex_);
      forget(sequence);
      return Error{ErrorCode::kFailed, "the request to " + name_ + " could not be sent"};
    }
  }
  std::optional<std::string> answer;
  wait([&] {
    const std::lock_guard lock(mutex_);
    if (const auto found = answers_.find(sequence); found != answers_.end()) {
      answer = std::move(found->second);
    }
    return answer.has_value();
  });
  const std::lock_guard lock(mutex_);
  forget(sequence);
  answers_.erase(sequence);
  if (!answer) {
    return interrupted() ? stopped
                         : Error{ErrorCode::kTimeout, "port " + name_ + " did not answer within " +
                                                          std::to_string(timeout_s) + " s"};
  }
  return *std::move(answer);
}

void TextClient::forget(std::uint64_t sequence) {
  std::erase_if(awaited_, [&](const auto& entry) { return entry.second == sequence; });
}

void TextClient::on_message(std::shared_ptr<void> message, const MessageInfo& info) {
  {
    const std::lock_guard lock(mutex_);
    const Guid addressee = info.related.writer_guid();
    const std::uint64_t sequence = info.related.sequence_number().to64long();
    const auto call = awaited_.find({info.by_dds, sequence});
    if ((addressee != reply_reader_ && addressee != requests_->guid()) || call == awaited_.end()) {
      return;  // another client's, or too late
    }
    answers_[call->second] = std::move(static_cast<msgs::Text_Response*>(message.get())->text());
  }
  changed_->notify();
}

void TextClient::on_matched(const Guid& writer, bool matched) {
  {
    const std::lock_guard lock(mutex_);
    if (matched) {
      servers_.insert(writer);
    } else {
      servers_.erase(writer);
    }
  }
  changed_->notify();
}

}  // namespace nido
