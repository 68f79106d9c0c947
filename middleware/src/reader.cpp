#include "reader.h"

#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <map>
#include <mutex>
#include <set>

#include "lane_reader.h"
#include "lane_writer.h"

namespace nido {

namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::types::ReturnCode_t;

// Where messages come in, from both ways.
class Reader::Listener final : public dds::DataReaderListener,
                               public LaneSink,
                               public std::enable_shared_from_this<Reader::Listener> {
 public:
  Listener(Participant& participant, std::shared_ptr<LaneLoop> loop, MessageType type, ReaderEvents& events)
      : participant_(participant),
        loop_(std::move(loop)),
        type_(std::move(type)),
        support_(type_.make_support()),
        events_(&events) {}

  void on_data_available(dds::DataReader* reader) override {
    const std::lock_guard lock(mutex_);
    for (;;) {
      std::shared_ptr<void> message = type_.make_message();
      dds::SampleInfo sample;
      if (reader->take_next_sample(message.get(), &sample) != ReturnCode_t::RETCODE_OK) {
        return;
      }
      MessageInfo info;
      info.writer = sample.sample_identity.writer_guid();
      // what was written for others comes over a lane, too
      if (!sample.valid_data || events_ == nullptr || lanes_.contains(info.writer) ||
          participant_.is_near(info.writer)) {
        continue;
      }
      info.identity = sample.sample_identity;
      info.related = sample.related_sample_identity;
      info.sequence = sample.sample_identity.sequence_number().to64long();
      if (info.related.writer_guid() == info.writer) {  // an output of nido on another machine
        info.sequence = info.related.sequence_number().to64long();
      }
      info.source_time_ns = sample.source_timestamp.to_ns();
      info.bytes = support_->getSerializedSizeProvider(message.get())();
      info.by_dds = true;
      events_->on_message(std::move(message), info);
    }
  }

  void on_subscription_matched(dds::DataReader* reader,
                               const dds::SubscriptionMatchedStatus& status) override {
    const std::lock_guard lock(mutex_);
    if (events_ == nullptr) {
      return;
    }
    const Guid writer = rtps::iHandle2GUID(status.last_publication_handle);
    if (status.current_count_change > 0) {
      if (!participant_.is_near(writer)) {
        far_.insert(writer);
        events_->on_matched(writer, true);
      } else if (!lanes_.contains(writer)) {
        lanes_[writer] = LaneReader::open(loop_, writer, reader->guid(), weak_from_this());
      }
    } else if (far_.erase(writer) > 0) {
      events_->on_matched(writer, false);
    } else if (const auto lane = lanes_.find(writer); lane != lanes_.end() && lane->second->abandon()) {
      lanes_.erase(lane);
    }
    // One that has begun ends when its output does, whatever DDS thinks of a process that is silent for a
    // while.
  }

  void on_lane_start(const Guid& writer) override {
    const std::lock_guard lock(mutex_);
    if (events_ != nullptr) {
      events_->on_matched(writer, true);
    }
  }
  void on_lane_end(const Guid& writer) override {
    const std::lock_guard lock(mutex_);
    lanes_.erase(writer);
    if (events_ != nullptr) {
      events_->on_matched(writer, false);
    }
  }
  [[gnu::hot]] void on_lane_frame(const Guid& writer, const FrameHeader& header,
                                  std::span<const std::uint8_t> payload) override {
    const std::lock_guard lock(mutex_);
    if (events_ == nullptr) {
      return;
    }
    MessageInfo info;
    info.writer = writer;
    info.sequence = header.sequence;
    info.source_time_ns = header.source_time_ns;
    info.bytes = header.size;
    info.identity.writer_guid(writer);
    info.identity.sequence_number(sequence_number_of(header.sequence));
    if (header.related_sequence > 0) {
      info.related.writer_guid(unpack_guid(header.related));
      info.related.sequence_number(sequence_number_of(header.related_sequence));
    }
    if (events_->on_payload(payload, info)) {
      return;
    }
    std::shared_ptr<void> message = events_->spare_message();
    if (!message) {
      message = type_.make_message();
    }
    rtps::SerializedPayload_t serialized;
    // DDS asks for a mutable address but only reads
    serialized.data = const_cast<std::uint8_t*>(payload.data());
    serialized.length = serialized.max_size = static_cast<std::uint32_t>(payload.size());
    const bool is_whole = support_->deserialize(&serialized, message.get());
    serialized.data = nullptr;
    if (is_whole) {
      events_->on_message(std::move(message), info);
    }
  }

  void close() {
    std::map<Guid, std::shared_ptr<LaneReader>> lanes;
    {
      const std::lock_guard lock(mutex_);
      events_ = nullptr;
      lanes.swap(lanes_);
    }
    for (const auto& entry : lanes) {
      entry.second->close();
    }
  }

 private:
  Participant& participant_;  // which keeps this
  const std::shared_ptr<LaneLoop> loop_;
  std::mutex mutex_;
  const MessageType type_;
  dds::TypeSupport support_;
  ReaderEvents* events_;
  std::map<Guid, std::shared_ptr<LaneReader>> lanes_;  // by output
  std::set<Guid> far_;                                 // outputs that DDS connects
};

Result<std::unique_ptr<Reader>> Reader::open(std::shared_ptr<Participant> participant,
                                             const std::string& topic, const MessageType& type,
                                             const Quality& quality, const std::string& port_name,
                                             ReaderEvents& events, std::shared_ptr<LaneLoop> loop) {
  std::unique_ptr<Reader> self(new Reader());
  self->participant_ = std::move(participant);
  auto own_topic = topic_for(*self->participant_, topic, type, port_name);
  if (!own_topic) {
    return own_topic.error();
  }
  self->topic_ = std::move(own_topic).value();
  dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
  apply(quality, qos);
  qos.reliable_reader_qos().times.heartbeatResponseDelay = {0, 1'000'000};
  qos.user_data() = own_user_data(*self->participant_, type, quality, port_name);
  self->listener_ = std::make_shared<Listener>(
      *self->participant_, loop ? loop : self->participant_->lanes()->receiving(), type, events);
  {
    const auto making = self->participant_->one_endpoint_at_a_time();
    self->reader_ =
        self->participant_->subscriber()->create_datareader(self->topic_.get(), qos, self->listener_.get());
  }
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
    participant_->close(reader_, std::move(listener_));
  }
}

}  // namespace nido
