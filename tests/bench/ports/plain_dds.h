#pragma once

#include <fastdds/rtps/common/SerializedPayload.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <memory>
#include <string>

namespace nido::bench {

namespace dds = eprosima::fastdds::dds;

// Fast DDS by itself, as its manual recommends it for speed on one machine: a plain type, which it shares
// between processes without a copy, and listeners.
template <std::size_t N>
struct PlainBytes {
  std::array<std::uint8_t, N> data;
};

template <std::size_t N>
class PlainBytesSupport final : public dds::TopicDataType {
 public:
  PlainBytesSupport() {
    setName(("bench::Bytes" + std::to_string(N)).c_str());
    m_typeSize = N + kHeader_bytes;
  }
  bool serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override {
    payload->encapsulation = CDR_LE;
    constexpr std::array<std::uint8_t, kHeader_bytes> kHeader{0, 1, 0, 0};
    std::memcpy(payload->data, kHeader.data(), kHeader.size());
    std::memcpy(payload->data + kHeader_bytes, data, N);
    payload->length = N + kHeader_bytes;
    return true;
  }
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    std::memcpy(data, payload->data + kHeader_bytes, N);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* /*data*/) override {
    return [] { return static_cast<std::uint32_t>(N + kHeader_bytes); };
  }
  void* createData() override { return new PlainBytes<N>(); }
  void deleteData(void* data) override { delete static_cast<PlainBytes<N>*>(data); }
  bool getKey(void* /*data*/, eprosima::fastrtps::rtps::InstanceHandle_t* /*handle*/, bool /*md5*/) override {
    return false;
  }
  bool is_bounded() const override { return true; }
  bool is_plain() const override { return true; }
  bool construct_sample(void* memory) const override {
    new (memory) PlainBytes<N>();
    return true;
  }

 private:
  static constexpr std::size_t kHeader_bytes = 4;
};

// A participant with default transports.
class PlainParticipant {
 public:
  PlainParticipant(const PlainParticipant&) = delete;
  PlainParticipant& operator=(const PlainParticipant&) = delete;
  explicit PlainParticipant(int domain) {
    dds::Log::ClearConsumers();
    participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
        static_cast<dds::DomainId_t>(domain), dds::PARTICIPANT_QOS_DEFAULT);
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  }
  ~PlainParticipant() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  template <std::size_t N>
  dds::Topic* topic(const std::string& name) {
    dds::TypeSupport support(new PlainBytesSupport<N>());
    support.register_type(participant_);
    return participant_->create_topic(name, support.get_type_name(), dds::TOPIC_QOS_DEFAULT);
  }
  dds::DataWriter* writer(dds::Topic* topic, int depth) {
    dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.history().depth = depth;
    return publisher_->create_datawriter(topic, qos);
  }
  dds::DataReader* reader(dds::Topic* topic, int depth, dds::DataReaderListener* listener) {
    dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.history().depth = depth;
    return subscriber_->create_datareader(topic, qos, listener);
  }

 private:
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
};

}  // namespace nido::bench
