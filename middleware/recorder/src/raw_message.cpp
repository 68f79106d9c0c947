#include "nido/recorder/raw_message.h"

#include <chrono>
#include <cstring>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <utility>

#include "nido/recorder/idl_text.h"

namespace nido {
namespace {

namespace rtps = eprosima::fastrtps::rtps;

// what a message costs beside its bytes, about
constexpr std::size_t kOverheadBytes = 256;
constexpr std::uint32_t kFirstPayloadBytes = 1024;
constexpr std::int64_t kNsPerSecond = 1'000'000'000;

class RawSupport final : public eprosima::fastdds::dds::TopicDataType {
 public:
  RawSupport(const std::string& dds_name, std::shared_ptr<RawIntake> intake, bool is_clock)
      : intake_(std::move(intake)), is_clock_(is_clock) {
    setName(dds_name.c_str());
    // only where histories begin: they grow
    m_typeSize = kFirstPayloadBytes;
    m_isGetKeyDefined = false;
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }

  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto bytes = static_cast<RawMessage*>(data)->bytes();
    if (bytes.size() < 4 || bytes.size() > payload->max_size) return false;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = (bytes[1] & 1) != 0 ? CDR_LE : CDR_BE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    const std::string_view bytes(reinterpret_cast<const char*>(payload->data), payload->length);
    if (is_clock_ && intake_) {
      const std::int64_t time_ns = clock_of_bytes(bytes);
      if (time_ns >= 0) intake_->clock_ns.store(time_ns);
    }
    static_cast<RawMessage*>(data)->arrive(bytes, intake_);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    const auto size = static_cast<std::uint32_t>(static_cast<RawMessage*>(data)->bytes().size());
    return [size] { return size; };
  }
  void* createData() override { return new RawMessage(); }
  void deleteData(void* data) override { delete static_cast<RawMessage*>(data); }
  bool getKey(void* /*data*/, rtps::InstanceHandle_t* /*handle*/, bool /*force_md5*/) override {
    return false;
  }

 private:
  const std::shared_ptr<RawIntake> intake_;
  const bool is_clock_;
};

}  // namespace

RawMessage::RawMessage(std::string_view bytes)
    : bytes_(std::make_unique_for_overwrite<char[]>(bytes.size())), size_(bytes.size()) {
  std::memcpy(bytes_.get(), bytes.data(), bytes.size());
}

RawMessage::~RawMessage() {
  if (intake_) intake_->waiting_bytes.fetch_sub(size_ + kOverheadBytes);
}

void RawMessage::arrive(std::string_view bytes, const std::shared_ptr<RawIntake>& intake) {
  arrival_ns_ = std::chrono::duration_cast<std::chrono::nanoseconds>(
                    std::chrono::system_clock::now().time_since_epoch())
                    .count();
  if (intake) {
    clock_ns_ = intake->clock_ns.load();
    const std::size_t cost = bytes.size() + kOverheadBytes;
    if (intake->waiting_bytes.fetch_add(cost) + cost > intake->most_bytes && intake->most_bytes > 0) {
      intake->waiting_bytes.fetch_sub(cost);
      dropped_ = true;
      return;
    }
    intake_ = intake;
  }
  size_ = bytes.size();
  bytes_ = std::make_unique_for_overwrite<char[]>(size_);
  std::memcpy(bytes_.get(), bytes.data(), size_);
}

MessageType raw_message_type(const std::string& ros_name, std::shared_ptr<RawIntake> intake, bool is_clock) {
  MessageType type;
  // other programs' types need not be named as in ROS 2
  const bool is_ros =
      ros_name.find("/msg/") != std::string::npos || ros_name.find("/srv/") != std::string::npos;
  type.dds_name = is_ros ? MessageType::dds_name_of(ros_name) : scoped_name_of(ros_name);
  type.make_message = [] { return std::static_pointer_cast<void>(std::make_shared<RawMessage>()); };
  type.make_support = [name = type.dds_name, intake = std::move(intake), is_clock] {
    return static_cast<eprosima::fastdds::dds::TopicDataType*>(new RawSupport(name, intake, is_clock));
  };
  return type;
}

bool is_own_type(const std::string& ros_name) {
  return ros_name == "nido_msgs/msg/Log" || ros_name == "nido_msgs/msg/NodeInfo" ||
         ros_name == "nido_msgs/msg/Tick" || ros_name == "nido_msgs/msg/TickDone" ||
         ros_name.starts_with("nido_msgs/srv/Text_");
}

std::int64_t clock_of_bytes(std::string_view bytes) {
  // the four bytes in front, then seconds and nanoseconds of 32 bits each
  if (bytes.size() < 12) return -1;
  const bool little = (bytes[1] & 1) != 0;
  const auto word_at = [&](std::size_t at) {
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t shift = 8 * (little ? i : 3 - i);
      word |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + i])) << shift;
    }
    return word;
  };
  return std::int64_t{static_cast<std::int32_t>(word_at(4))} * kNsPerSecond + word_at(8);
}

std::string bytes_of_clock(std::int64_t time_ns) {
  std::string bytes("\0\1\0\0", 4);
  for (const std::int64_t value : {time_ns / kNsPerSecond, time_ns % kNsPerSecond}) {
    for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>(value >> (8 * i)));
  }
  return bytes;
}

}  // namespace nido
