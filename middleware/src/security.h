#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <string>

#include "nido/interfaces/result.h"

namespace nido {

// Lets a participant take part with the keys of a folder (key_store.h): the identity of the node if there is
// one, else `anybody`. kNotFound names the file that is missing or cannot be read.
Status use_keys(const std::string& folder, const std::string& node_name,
                eprosima::fastdds::dds::DomainParticipantQos& qos);

}  // namespace nido
