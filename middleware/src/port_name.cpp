#include "nido/middleware/port_name.h"

#include <cctype>

#include "nido/middleware/raw_port.h"

namespace nido {

namespace {

// the part of a port name that DDS sees
std::string stem_of(const std::string& name) {
  const bool has_suffix = name.size() > 2 && (name.ends_with(":o") || name.ends_with(":i"));
  return has_suffix ? name.substr(0, name.size() - 2) : name;
}

}  // namespace

Status check_port_name(const std::string& port_name) {
  const auto refuse = [&](const std::string& why) {
    return Error{ErrorCode::kInvalidArgument,
                 "port name '" + port_name + "' " + why + "; a good one is '/vision/objects:o'"};
  };
  const std::string stem = stem_of(port_name);
  if (stem.empty() || stem.front() != '/') {
    return refuse("does not begin with '/'");
  }
  if (stem.back() == '/' || stem.find("//") != std::string::npos) {
    return refuse("has an empty word between its '/'");
  }
  for (const char c : stem) {
    if (c != '/' && c != '_' && std::isalnum(static_cast<unsigned char>(c)) == 0) {
      return refuse(std::string("has the letter '") + c + "', allowed are letters, digits, '_', '/'");
    }
  }
  if (stem.size() > 200) {
    return refuse("is longer than 200 letters");
  }
  return {};
}

std::string topic_of(const std::string& output_name) { return "rt" + stem_of(output_name); }
std::string request_topic_of(const std::string& service_name) {
  return "rq" + stem_of(service_name) + "Request";
}
std::string reply_topic_of(const std::string& service_name) { return "rr" + stem_of(service_name) + "Reply"; }

std::string to_string(Profile profile) {
  switch (profile) {
    case Profile::kSensor:
      return "sensor";
    case Profile::kState:
      return "state";
    case Profile::kCommand:
      return "command";
    case Profile::kEvent:
      return "event";
  }
  return "unknown";
}

Result<Profile> profile_from_string(const std::string& word) {
  for (const Profile profile : {Profile::kSensor, Profile::kState, Profile::kCommand, Profile::kEvent}) {
    if (word == to_string(profile)) {
      return profile;
    }
  }
  return Error{ErrorCode::kInvalidArgument,
               "profile '" + word + "' is unknown; there are sensor, state, command and event"};
}

std::string MessageType::ros_name() const {
  std::string name = dds_name;
  if (const auto at = name.find("::dds_::"); at != std::string::npos) {
    name.replace(at, 8, "::");
  }
  if (name.ends_with('_')) {
    name.pop_back();
  }
  for (auto at = name.find("::"); at != std::string::npos; at = name.find("::")) {
    name.replace(at, 2, "/");
  }
  return name;
}

std::string MessageType::dds_name_of(const std::string& ros_name) {
  const auto last = ros_name.rfind('/');
  if (last == std::string::npos) {
    return ros_name;
  }
  std::string name = ros_name.substr(0, last) + "/dds_/" + ros_name.substr(last + 1) + "_";
  for (auto at = name.find('/'); at != std::string::npos; at = name.find('/')) {
    name.replace(at, 1, "::");
  }
  return name;
}

}  // namespace nido
