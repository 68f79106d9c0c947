#include "writer.h"

#include <fastdds/rtps/common/WriteParams.h>

#include <algorithm>
#include <atomic>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <mutex>

#include "lane_writer.h"
#include "latest_sender.h"

namespace nido {

namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::types::ReturnCode_t;

namespace {

bool deserialize(const dds::TypeSupport& support, std::span<const std::uint8_t> payload, void* message) {
  rtps::SerializedPayload_t serialized;
  // DDS asks for a mutable address but only reads
  serialized.data = const_cast<std::uint8_t*>(payload.data());
  serialized.length = serialized.max_size = static_cast<std::uint32_t>(payload.size());
  const bool is_whole = support->deserialize(&serialized, message);
  serialized.data = nullptr;
  return is_whole;
}

}  // namespace

// What a writer shares with the threads of DDS and of the lanes.
class Writer::Listener final : public dds::DataWriterListener,
                               public std::enable_shared_from_this<Writer::Listener> {
 public:
  Listener(Participant& participant, std::shared_ptr<LaneLoop> loop, bool keeps, dds::TypeSupport support)
      : participant_(participant), loop_(std::move(loop)), keeps_(keeps), support_(std::move(support)) {}

  void on_publication_matched(dds::DataWriter* /*writer*/,
                              const dds::PublicationMatchedStatus& status) override {
    const Guid reader = rtps::iHandle2GUID(status.last_subscription_handle);
    if (status.current_count_change > 0) {
      // inputs that can be reached over a lane ask for it themselves
      if (participant_.is_near(reader)) {
        return;
      }
      {
        const std::lock_guard lock(mutex_);
        far_.insert(reader);
      }
      has_far_.store(true);
      if (keeps_) {
        loop_->post([self = shared_from_this()] {
          const std::lock_guard lock(self->dds_mutex_);
          self->catch_up();
        });
      }
    } else {
      const std::lock_guard lock(mutex_);
      if (far_.erase(reader) == 0) {
        return;
      }
      has_far_.store(!far_.empty());
    }
    notify();
  }

  void notify() {
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

  [[nodiscard]] bool has_far() const { return has_far_.load(); }
  [[nodiscard]] std::set<Guid> readers() const {
    const auto lane = this->lane();
    std::set<Guid> all = lane ? lane->readers() : std::set<Guid>();
    const std::lock_guard lock(mutex_);
    all.insert(far_.begin(), far_.end());
    return all;
  }
  [[nodiscard]] const std::shared_ptr<ChangeSignal>& signal() const { return signal_; }

  // Once, before others can know of the writer's existence or right after.
  void set_ends(dds::DataWriter* writer, std::shared_ptr<LaneWriter> lane) {
    const std::lock_guard dds_lock(dds_mutex_);
    writer_ = writer;
    const std::lock_guard lock(mutex_);
    lane_ = std::move(lane);
  }
  void close() {
    std::shared_ptr<LaneWriter> lane;  // holds this, and goes without the locks
    const std::lock_guard dds_lock(dds_mutex_);
    writer_ = nullptr;
    const std::lock_guard lock(mutex_);
    lane.swap(lane_);
  }

  // Sends by DDS what is the lanes' message `sequence`.
  Sent write_by_dds(const void* message, const SampleId* related, std::uint64_t sequence) {
    const std::lock_guard lock(dds_mutex_);
    catch_up();
    // DDS refuses what it cannot keep for a reader
    return (keeps_ && told_ >= sequence) || tell(message, related, sequence) ? Sent::kYes : Sent::kNoRoom;
  }
  void write_payload_by_dds(std::span<const std::uint8_t> payload, std::uint64_t sequence) {
    void* const message = support_->createData();
    if (deserialize(support_, payload, message)) {
      (void)write_by_dds(message, nullptr, sequence);
    }
    support_->deleteData(message);
  }
  // Nobody is there whom DDS serves: what it keeps grows old.
  void forget_by_dds() {
    if (!keeps_) {
      return;
    }
    const std::lock_guard lock(dds_mutex_);
    if (told_ > forgotten_ && writer_ != nullptr) {
      std::size_t removed = 0;
      writer_->clear_history(&removed);
      forgotten_ = told_;
    }
  }
  [[nodiscard]] std::uint64_t written_by_dds() const { return written_by_dds_.load(); }

 private:
  [[nodiscard]] std::shared_ptr<LaneWriter> lane() const {
    const std::lock_guard lock(mutex_);
    return lane_;
  }
  // with dds_mutex_: what is kept for late joiners is with DDS afterwards
  void catch_up() {
    const auto lane = this->lane();
    if (!keeps_ || !lane || writer_ == nullptr || told_ >= lane->written()) {
      return;
    }
    void* const message = support_->createData();
    lane->each_kept([&](std::span<const std::uint8_t> payload, std::uint64_t sequence) {
      if (sequence <= told_) {
        return;
      }
      if (deserialize(support_, payload, message)) {
        tell(message, nullptr, sequence);
      }
    });
    support_->deleteData(message);
  }
  bool tell(const void* message, const SampleId* related, std::uint64_t sequence) {
    if (writer_ == nullptr) {
      return false;
    }
    rtps::WriteParams params;
    if (related != nullptr) {
      params.related_sample_identity(*related);
    } else {
      // for inputs of nido on other machines: the number that this message has everywhere
      SampleId own;
      own.writer_guid(writer_->guid());
      own.sequence_number(sequence_number_of(sequence));
      params.related_sample_identity(own);
    }
    // DDS asks for a mutable address but only reads
    if (!writer_->write(const_cast<void*>(message), params)) {
      return false;
    }
    told_ = std::max(told_, sequence);
    written_by_dds_.store(params.sample_identity().sequence_number().to64long());
    return true;
  }

  Participant& participant_;  // which keeps this
  const std::shared_ptr<LaneLoop> loop_;
  const bool keeps_;
  const dds::TypeSupport support_;
  std::atomic<bool> has_far_{false};
  std::atomic<std::uint64_t> written_by_dds_{0};

  mutable std::mutex mutex_;
  std::shared_ptr<LaneWriter> lane_;
  std::set<Guid> far_;  // readers that DDS serves
  const std::shared_ptr<ChangeSignal> signal_ = std::make_shared<ChangeSignal>();
  std::vector<std::shared_ptr<ChangeSignal>> also_;

  std::mutex dds_mutex_;
  dds::DataWriter* writer_ = nullptr;
  std::uint64_t told_ = 0;       // number of the last message that DDS has got
  std::uint64_t forgotten_ = 0;  // and of the last one that it need not keep any more
};

Writer::Writer() = default;

Result<std::unique_ptr<Writer>> Writer::open(std::shared_ptr<Participant> participant,
                                             const std::string& topic, const MessageType& type,
                                             const Quality& quality, const std::string& port_name) {
  std::unique_ptr<Writer> self(new Writer());
  self->participant_ = std::move(participant);
  auto own_topic = topic_for(*self->participant_, topic, type, port_name);
  if (!own_topic) {
    return own_topic.error();
  }
  self->topic_ = std::move(own_topic).value();
  const auto lanes = self->participant_->lanes();
  dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
  apply(quality, qos);
  // sent by the writing thread itself: no hop to another one
  qos.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
  qos.reliability().max_blocking_time = {0, 200'000'000};
  // a message that was lost is asked for again soon, not after the default of three seconds; commands, which
  // are small and wait for each other, sooner still, and again before the answer can be here, as that may be
  // lost, too
  qos.reliable_writer_qos().times.heartbeatPeriod = {
      0, quality.keep_all ? 10'000'000U : (quality.repaired ? 20'000'000U : 50'000'000U)};
  qos.reliable_writer_qos().times.nackResponseDelay = {0, 1'000'000};
  qos.user_data() = own_user_data(*self->participant_, type, quality, port_name);
  const dds::TypeSupport support(type.make_support());
  self->listener_ =
      std::make_shared<Listener>(*self->participant_, lanes->sending(), quality.transient_local, support);
  {
    const auto making = self->participant_->one_endpoint_at_a_time();
    self->writer_ =
        self->participant_->publisher()->create_datawriter(self->topic_.get(), qos, self->listener_.get());
  }
  if (self->writer_ == nullptr) {
    return cannot_open(*self->participant_, port_name, topic, type);
  }
  self->guid_ = self->writer_->guid();
  LaneWriter::Settings settings;
  settings.reliable = quality.reliable;
  settings.keep_all = quality.keep_all;
  settings.transient_local = quality.transient_local;
  settings.depth = static_cast<std::size_t>(quality.depth);
  self->support_ = support;
  self->lane_ = std::make_shared<LaneWriter>(lanes->sending(), self->guid_, settings, support,
                                             [listener = self->listener_] { listener->notify(); });
  self->listener_->set_ends(self->writer_, self->lane_);
  if (!quality.reliable && self->participant_->is_on_network()) {
    self->far_sender_ = std::make_unique<LatestSender>(
        [listener = self->listener_](std::span<const std::uint8_t> payload, std::uint64_t sequence) {
          listener->write_payload_by_dds(payload, sequence);
        });
  }
  lanes->enter(self->lane_);
  self->participant_->add_endpoint(self->guid_,
                                   own_info(*self->participant_, topic, type, quality, port_name, true));
  return self;
}

Writer::~Writer() {
  far_sender_.reset();
  if (lane_) {
    participant_->lanes()->leave(guid_);
    lane_->close();
  }
  if (listener_) {
    listener_->close();
  }
  if (writer_ != nullptr) {
    participant_->close(writer_, std::move(listener_));
  }
}

Sent Writer::write(const void* message, const SampleId* related) {
  LaneWriter::Related answer;
  if (related != nullptr) {
    answer.reader = related->writer_guid();
    answer.sequence = static_cast<std::uint64_t>(related->sequence_number().to64long());
  }
  if (const Sent sent = lane_->write(message, related != nullptr ? &answer : nullptr); sent != Sent::kYes) {
    return sent;
  }
  if (!listener_->has_far()) {
    listener_->forget_by_dds();
    return Sent::kYes;
  }
  if (!far_sender_) {
    return listener_->write_by_dds(message, related, lane_->written());
  }
  auto* const data = const_cast<void*>(message);  // DDS asks for a mutable address but only reads
  rtps::SerializedPayload_t payload(support_->getSerializedSizeProvider(data)());
  if (!support_->serialize(data, &payload)) {
    return Sent::kFailed;
  }
  far_sender_->post({payload.data, payload.length}, lane_->written());
  return Sent::kYes;
}

[[gnu::hot]] std::uint8_t* Writer::loan(std::size_t bytes) { return lane_->loan(bytes); }

[[gnu::hot]] Sent Writer::write_loan(std::size_t bytes) {
  if (!listener_->has_far()) {
    const Sent sent = lane_->write_loan(bytes);
    listener_->forget_by_dds();
    return sent;
  }
  if (lane_->loaned().size() < bytes) {
    return Sent::kFailed;
  }
  const auto payload = lane_->loaned().first(bytes);
  if (far_sender_) {
    // numbered as the lanes number it, and only if they do: its place stays as it is until the next loan
    const Sent sent = lane_->write_loan(bytes);
    if (sent == Sent::kYes) {
      far_sender_->post(payload, lane_->written());
    }
    return sent;
  }
  // others get it the usual way
  void* const message = support_->createData();
  Sent sent = Sent::kFailed;
  if (deserialize(support_, payload, message)) {
    sent = lane_->write_loan(bytes);
    if (sent == Sent::kYes) {
      sent = listener_->write_by_dds(message, nullptr, lane_->written());
    }
  }
  support_->deleteData(message);
  return sent;
}

std::uint64_t Writer::written() const { return lane_->written(); }
std::uint64_t Writer::written_by_dds() const { return listener_->written_by_dds(); }

bool Writer::wait_until_received(double timeout_s) {
  return lane_->wait_until_received(timeout_s) &&
         (!listener_->has_far() || writer_->wait_for_acknowledgments(eprosima::fastrtps::Duration_t(
                                       timeout_s)) == ReturnCode_t::RETCODE_OK);
}

std::set<Guid> Writer::readers() const { return listener_->readers(); }
std::size_t Writer::reader_count() const { return listener_->readers().size(); }
void Writer::notify_also(std::shared_ptr<ChangeSignal> also) { listener_->notify_also(std::move(also)); }
const std::shared_ptr<ChangeSignal>& Writer::readers_signal() const { return listener_->signal(); }

}  // namespace nido
