#include "endpoints.h"

#include <fastdds/rtps/common/WriteParams.h>

#include <algorithm>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>

#include "nido/middleware/port_name.h"
#include "user_data.h"

namespace nido {

namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::types::ReturnCode_t;

namespace {

// what a command port keeps for a reader that does not acknowledge, before the sender is told
constexpr int kCommandRoom = 2000;
// how many messages of one port may be under way in lockstep: those of two ticks, as one reader may still
// wait for the last tick's when the source works on this one
constexpr int kLockstepDepth = 16;
// messages that came while one before them is missing
constexpr int kReaderDepth = 1024;

template <class Qos>
void apply(const Quality& quality, Qos& qos) {
  qos.reliability().kind =
      quality.reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind =
      quality.transient_local ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = quality.keep_all ? dds::KEEP_ALL_HISTORY_QOS : dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = quality.depth;
  qos.resource_limits().max_samples = quality.keep_all ? kCommandRoom : std::max(quality.depth, 1);
  qos.resource_limits().max_samples_per_instance = qos.resource_limits().max_samples;
  qos.resource_limits().max_instances = 1;
  qos.resource_limits().allocated_samples = 1;
  // data sharing leaves files of image size behind a killed process, and only plain types could use it
  qos.data_sharing().off();
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
}

EndpointInfo own_info(const Participant& participant, const std::string& topic, const MessageType& type,
                      const Quality& quality, const std::string& port_name, bool is_writer) {
  EndpointInfo info;
  info.is_writer = is_writer;
  info.topic = topic;
  info.dds_type = type.dds_name;
  info.node = participant.node_name();
  info.port = port_name;
  info.profile = quality.profile;
  info.reliable = quality.reliable;
  info.transient_local = quality.transient_local;
  return info;
}

Error cannot_open(const Participant& participant, const std::string& port_name, const std::string& topic,
                  const MessageType& type) {
  std::string others;
  for (const auto& [guid, info] : participant.endpoints_of(topic)) {
    if (info.dds_type != type.dds_name) {
      others = " (" + (info.port.empty() ? "another program" : info.port + " of node " + info.node) +
               " uses the topic with type " + info.dds_type + ")";
    }
  }
  return {ErrorCode::kInvalidArgument,
          "port " + port_name + " cannot be made on topic " + topic + " with type " + type.dds_name + others};
}

}  // namespace

Quality Quality::of(Profile profile, std::size_t depth, bool is_writer, bool lockstep) {
  Quality quality;
  quality.profile = to_string(profile);
  const int n = static_cast<int>(std::clamp<std::size_t>(depth, 1, 10000));
  switch (profile) {
    case Profile::kSensor:
      quality.reliable = false;
      quality.depth = 1;
      break;
    case Profile::kState:
      quality.transient_local = true;
      quality.depth = 1;
      break;
    case Profile::kCommand:
      quality.keep_all = true;
      break;
    case Profile::kEvent:
      quality.depth = n;
      break;
  }
  // A reader's own history is only a step on the way to the port's queue. It is deeper than one, as the
  // pieces of several messages may be under way.
  if (!is_writer && !quality.keep_all) {
    quality.depth = std::max(quality.depth, kLockstepDepth);
  }
  if (lockstep) {
    quality.reliable = true;
    if (!quality.keep_all) {
      quality.depth = is_writer ? std::max(2 * quality.depth, kLockstepDepth) : kReaderDepth;
    }
  }
  return quality;
}

class Reader::Listener final : public dds::DataReaderListener {
 public:
  Listener(MessageType type, ReaderEvents& events)
      : type_(std::move(type)), support_(type_.make_support()), events_(&events) {}

  void on_data_available(dds::DataReader* reader) override {
    const std::lock_guard lock(mutex_);
    for (;;) {
      std::shared_ptr<void> message = type_.make_message();
      dds::SampleInfo sample;
      if (reader->take_next_sample(message.get(), &sample) != ReturnCode_t::RETCODE_OK) {
        return;
      }
      if (!sample.valid_data || events_ == nullptr) {
        continue;
      }
      MessageInfo info;
      info.identity = sample.sample_identity;
      info.related = sample.related_sample_identity;
      info.writer = sample.sample_identity.writer_guid();
      info.sequence = sample.sample_identity.sequence_number().to64long();
      info.source_time_ns = sample.source_timestamp.to_ns();
      info.bytes = support_->getSerializedSizeProvider(message.get())();
      events_->on_message(std::move(message), info);
    }
  }

  void on_subscription_matched(dds::DataReader* /*reader*/,
                               const dds::SubscriptionMatchedStatus& status) override {
    const std::lock_guard lock(mutex_);
    if (events_ != nullptr) {
      events_->on_matched(rtps::iHandle2GUID(status.last_publication_handle),
                          status.current_count_change > 0);
    }
  }

  void close() {
    const std::lock_guard lock(mutex_);
    events_ = nullptr;
  }

 private:
  std::mutex mutex_;
  const MessageType type_;
  dds::TypeSupport support_;
  ReaderEvents* events_;
};

Result<std::unique_ptr<Reader>> Reader::open(std::shared_ptr<Participant> participant,
                                             const std::string& topic, const MessageType& type,
                                             const Quality& quality, const std::string& port_name,
                                             ReaderEvents& events) {
  std::unique_ptr<Reader> self(new Reader());
  self->participant_ = std::move(participant);
  self->topic_ = self->participant_->acquire_topic(topic, type);
  if (self->topic_ == nullptr) {
    return cannot_open(*self->participant_, port_name, topic, type);
  }
  dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
  apply(quality, qos);
  qos.reliable_reader_qos().times.heartbeatResponseDelay = {0, 1'000'000};
  qos.user_data().setValue(
      pack_user_data({self->participant_->node_name(), port_name, quality.profile, type.dds_name}));
  self->listener_ = std::make_shared<Listener>(type, events);
  self->participant_->keep(self->listener_);
  self->reader_ =
      self->participant_->subscriber()->create_datareader(self->topic_, qos, self->listener_.get());
  if (self->reader_ == nullptr) {
    return cannot_open(*self->participant_, port_name, topic, type);
  }
  self->guid_ = self->reader_->guid();
  self->participant_->add_endpoint(self->guid_,
                                   own_info(*self->participant_, topic, type, quality, port_name, false));
  return self;
}

Reader::~Reader() {
  if (listener_) {
    listener_->close();
  }
  if (reader_ != nullptr) {
    reader_->set_listener(nullptr);
    participant_->subscriber()->delete_datareader(reader_);
    participant_->remove_endpoint(guid_);
  }
  if (topic_ != nullptr) {
    participant_->release_topic(topic_);
  }
}

class Writer::Listener final : public dds::DataWriterListener {
 public:
  void on_publication_matched(dds::DataWriter* /*writer*/,
                              const dds::PublicationMatchedStatus& status) override {
    {
      const std::lock_guard lock(mutex_);
      const Guid reader = rtps::iHandle2GUID(status.last_subscription_handle);
      if (status.current_count_change > 0) {
        readers_.insert(reader);
      } else {
        readers_.erase(reader);
      }
    }
    signal_->notify();
    std::vector<std::shared_ptr<ChangeSignal>> also;
    {
      const std::lock_guard lock(mutex_);
      also = also_;
    }
    for (const auto& signal : also) {
      signal->notify();
    }
  }

  void notify_also(std::shared_ptr<ChangeSignal> also) {
    const std::lock_guard lock(mutex_);
    also_.push_back(std::move(also));
  }

  [[nodiscard]] std::set<Guid> readers() const {
    const std::lock_guard lock(mutex_);
    return readers_;
  }
  [[nodiscard]] const std::shared_ptr<ChangeSignal>& signal() const { return signal_; }

 private:
  mutable std::mutex mutex_;
  std::set<Guid> readers_;
  const std::shared_ptr<ChangeSignal> signal_ = std::make_shared<ChangeSignal>();
  std::vector<std::shared_ptr<ChangeSignal>> also_;
};

Result<std::unique_ptr<Writer>> Writer::open(std::shared_ptr<Participant> participant,
                                             const std::string& topic, const MessageType& type,
                                             const Quality& quality, const std::string& port_name) {
  std::unique_ptr<Writer> self(new Writer());
  self->participant_ = std::move(participant);
  self->topic_ = self->participant_->acquire_topic(topic, type);
  if (self->topic_ == nullptr) {
    return cannot_open(*self->participant_, port_name, topic, type);
  }
  dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
  apply(quality, qos);
  // sent by the writing thread itself: no hop to another one
  qos.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
  qos.reliability().max_blocking_time = {0, 200'000'000};
  // a message that shared memory had no room for is asked for again soon, not after the default of three
  // seconds
  qos.reliable_writer_qos().times.heartbeatPeriod = {0, 50'000'000};
  qos.reliable_writer_qos().times.nackResponseDelay = {0, 1'000'000};
  qos.user_data().setValue(
      pack_user_data({self->participant_->node_name(), port_name, quality.profile, type.dds_name}));
  self->listener_ = std::make_shared<Listener>();
  self->participant_->keep(self->listener_);
  self->writer_ =
      self->participant_->publisher()->create_datawriter(self->topic_, qos, self->listener_.get());
  if (self->writer_ == nullptr) {
    return cannot_open(*self->participant_, port_name, topic, type);
  }
  self->guid_ = self->writer_->guid();
  self->participant_->add_endpoint(self->guid_,
                                   own_info(*self->participant_, topic, type, quality, port_name, true));
  return self;
}

Writer::~Writer() {
  if (writer_ != nullptr) {
    writer_->set_listener(nullptr);
    participant_->publisher()->delete_datawriter(writer_);
    participant_->remove_endpoint(guid_);
  }
  if (topic_ != nullptr) {
    participant_->release_topic(topic_);
  }
}

bool Writer::write(const void* message, const SampleId* related, SampleId* identity) {
  rtps::WriteParams params;
  if (related != nullptr) {
    params.related_sample_identity(*related);
  }
  // DDS asks for a mutable address but only reads
  if (!writer_->write(const_cast<void*>(message), params)) {
    return false;
  }
  written_.store(params.sample_identity().sequence_number().to64long(), std::memory_order_release);
  if (identity != nullptr) {
    *identity = params.sample_identity();
  }
  return true;
}

bool Writer::wait_until_received(double timeout_s) {
  return writer_->wait_for_acknowledgments(eprosima::fastrtps::Duration_t(timeout_s)) ==
         ReturnCode_t::RETCODE_OK;
}

std::set<Guid> Writer::readers() const { return listener_->readers(); }
std::size_t Writer::reader_count() const { return listener_->readers().size(); }
void Writer::notify_also(std::shared_ptr<ChangeSignal> also) { listener_->notify_also(std::move(also)); }
const std::shared_ptr<ChangeSignal>& Writer::readers_signal() const { return listener_->signal(); }

}  // namespace nido
