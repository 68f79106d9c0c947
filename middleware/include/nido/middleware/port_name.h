#pragma once

#include <string>

#include "nido/interfaces/result.h"
#include "nido/middleware/port.h"

namespace nido {

// Port names and the DDS names behind them (docs/ports.md).

// A name is "/" and words of letters, digits and "_" with "/" between; a port may end in ":o" or ":i".
Status check_port_name(const std::string& port_name);
// "/a/b:o" -> "rt/a/b".
std::string topic_of(const std::string& output_name);
// "/a/rpc:i" -> "rq/a/rpcRequest" and "rr/a/rpcReply".
std::string request_topic_of(const std::string& service_name);
std::string reply_topic_of(const std::string& service_name);
// "sensor", "state", "command", "event".
std::string to_string(Profile profile);
Result<Profile> profile_from_string(const std::string& word);

}  // namespace nido
