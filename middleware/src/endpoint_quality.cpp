#include "endpoint_quality.h"

#include <algorithm>

#include "lane_writer.h"
#include "nido/middleware/port_name.h"
#include "user_data.h"

namespace nido {

namespace rtps = eprosima::fastrtps::rtps;

namespace {

// what a command port keeps for a reader that does not acknowledge, before the sender is told
constexpr int kCommandRoom = 2000;
// how many messages of one port may be under way in lockstep: those of two ticks, as one reader may still
// wait for the last tick's when the source works on this one
constexpr int kLockstepDepth = 16;
// messages that came while one before them is missing
constexpr int kReaderDepth = 1024;
// pictures of one camera that are repaired at a time: a quarter of a second at 30 Hz, in which a packet can
// be asked for again several times. What is older is given up, and those after it are handed on.
constexpr int kPicturesInRepair = 8;

template <class Qos>
void fill(const Quality& quality, Qos& qos) {
  qos.reliability().kind =
      quality.reliable || quality.repaired ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
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

}  // namespace

void apply(const Quality& quality, dds::DataWriterQos& qos) { fill(quality, qos); }
void apply(const Quality& quality, dds::DataReaderQos& qos) { fill(quality, qos); }

Quality Quality::of(Profile profile, std::size_t depth, bool is_writer, bool lockstep,
                    bool repairs_pictures) {
  Quality quality;
  quality.profile = to_string(profile);
  const int n = static_cast<int>(std::clamp<std::size_t>(depth, 1, 10000));
  switch (profile) {
    case Profile::kSensor:
      quality.reliable = false;
      quality.repaired = repairs_pictures && !lockstep;
      quality.depth = repairs_pictures && is_writer ? kPicturesInRepair : 1;
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

EndpointInfo own_info(const Participant& participant, const std::string& topic, const MessageType& type,
                      const Quality& quality, const std::string& port_name, bool is_writer) {
  EndpointInfo info;
  info.is_writer = is_writer;
  info.topic = topic;
  info.dds_type = type.dds_name;
  info.node = participant.node_name();
  info.port = port_name;
  info.profile = quality.profile;
  info.reliable = quality.reliable || quality.repaired;
  info.transient_local = quality.transient_local;
  return info;
}

dds::UserDataQosPolicy own_user_data(const Participant& participant, const MessageType& type,
                                     const Quality& quality, const std::string& port_name) {
  dds::UserDataQosPolicy policy;
  policy.setValue(pack_user_data(
      {participant.node_name(), port_name, quality.profile, type.dds_name, participant.lane_place()}));
  return policy;
}

Result<std::shared_ptr<dds::Topic>> topic_for(Participant& participant, const std::string& topic,
                                              const MessageType& type, const std::string& port_name) {
  if (!participant.lanes()) {
    return no_lanes(port_name);
  }
  auto found = participant.topic(topic, type);
  if (!found) {
    return cannot_open(participant, port_name, topic, type);
  }
  return found;
}

Error cannot_open(const Participant& participant, const std::string& port_name, const std::string& topic,
                  const MessageType& type) {
  std::string others;
  for (const EndpointInfo& info : participant.endpoints()) {
    if (info.topic == topic && info.dds_type != type.dds_name) {
      others = " (" + (info.port.empty() ? "another program" : info.port + " of node " + info.node) +
               " uses the topic with type " + info.dds_type + ")";
    }
  }
  return {ErrorCode::kInvalidArgument,
          "port " + port_name + " cannot be made on topic " + topic + " with type " + type.dds_name + others};
}

Error no_lanes(const std::string& port_name) {
  return {ErrorCode::kFailed,
          "port " + port_name + " cannot be made: this process gets no more sockets or threads"};
}

rtps::SequenceNumber_t sequence_number_of(std::uint64_t number) {
  return {static_cast<std::int32_t>(number >> 32U), static_cast<std::uint32_t>(number)};
}

}  // namespace nido
