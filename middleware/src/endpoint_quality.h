#pragma once

#include <cstddef>
#include <cstdint>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <string>

#include "nido/middleware/port.h"
#include "participant.h"

namespace nido {

using SampleId = eprosima::fastrtps::rtps::SampleIdentity;

// The DDS qualities of an endpoint that this project uses.
struct Quality {
  bool reliable = true;
  // What is not reliable: sent again to other computers as long as it is among the newest.
  bool repaired = false;
  bool transient_local = false;
  bool keep_all = false;
  int depth = 1;
  std::string profile;  // told to others; empty for internal endpoints

  // `lockstep`: a barrier can wait only for what is sure to arrive, so everything is reliable then.
  // `repairs_pictures`: as the network file says.
  static Quality of(Profile profile, std::size_t depth, bool is_writer, bool lockstep, bool repairs_pictures);
};

// The same in the words of DDS.
void apply(const Quality& quality, dds::DataWriterQos& qos);
void apply(const Quality& quality, dds::DataReaderQos& qos);

// How a participant describes an endpoint of its own.
EndpointInfo own_info(const Participant& participant, const std::string& topic, const MessageType& type,
                      const Quality& quality, const std::string& port_name, bool is_writer);
// The same as it is told to the others (user_data.h).
eprosima::fastdds::dds::UserDataQosPolicy own_user_data(const Participant& participant,
                                                        const MessageType& type, const Quality& quality,
                                                        const std::string& port_name);
// What an endpoint needs before it is made: the participant's lanes, and its topic.
Result<std::shared_ptr<dds::Topic>> topic_for(Participant& participant, const std::string& topic,
                                              const MessageType& type, const std::string& port_name);
// Why an endpoint was not made.
Error cannot_open(const Participant& participant, const std::string& port_name, const std::string& topic,
                  const MessageType& type);
Error no_lanes(const std::string& port_name);

eprosima::fastrtps::rtps::SequenceNumber_t sequence_number_of(std::uint64_t number);

}  // namespace nido
