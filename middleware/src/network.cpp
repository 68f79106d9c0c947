#include "nido/middleware/network.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <array>
#include <cstdlib>
#include <map>

namespace nido {

namespace {

constexpr int kLargestPacket_bytes = 65500;
// what the DDS library sends of certificates and permissions in one piece: more than 4000, less than this
constexpr int kCertificates_bytes = 8000;

Error refuse(const std::string& file, const YAML::Node& node, const std::string& sentence) {
  return {ErrorCode::kInvalidArgument, file + ":" + std::to_string(node.Mark().line + 1) + ": " + sentence};
}

bool is_ipv4(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

struct Interface {
  std::string address;    // IPv4
  bool has_link = false;  // a cable or a wireless network
};

// by name, those that are up
std::map<std::string, Interface> interfaces() {
  std::map<std::string, Interface> found;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) {
    return found;
  }
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET && (one->ifa_flags & IFF_UP) != 0) {
      std::array<char, INET_ADDRSTRLEN> text{};
      const auto* const address = reinterpret_cast<const sockaddr_in*>(one->ifa_addr);
      found[one->ifa_name] = {inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size()),
                              (one->ifa_flags & IFF_RUNNING) != 0};
    }
  }
  freeifaddrs(list);
  return found;
}

Status choose_interface(const std::string& file, const YAML::Node& value, NetworkSettings& settings) {
  const auto wanted = value.as<std::string>();
  std::string there;
  for (const auto& [name, one] : interfaces()) {
    if (wanted != name && wanted != one.address) {
      there += (there.empty() ? "" : ", ") + name + " (" + one.address + ")";
      continue;
    }
    // the DDS library opens nothing there, and does not try again
    if (!one.has_link) {
      return Error{ErrorCode::kNotFound,
                   file + ": interface " + name + " (" + one.address +
                       ") has no link: is its cable in, or its wireless network joined?"};
    }
    settings.interface_name = name;
    settings.address = one.address;
    return {};
  }
  return refuse(file, value, "there is no interface '" + wanted + "'; there are " + there);
}

Status read_peers(const std::string& file, const YAML::Node& value, NetworkSettings& settings) {
  if (!value.IsSequence()) {
    return refuse(file, value, "peers is a list of IPv4 addresses, such as [192.168.7.3]");
  }
  for (const auto& item : value) {
    const auto peer = item.as<std::string>();
    if (!is_ipv4(peer)) {
      return refuse(file, item, "peer '" + peer + "' is not an IPv4 address, such as 192.168.7.3");
    }
    settings.peers.push_back(peer);
  }
  return {};
}

Status read_number(const std::string& file, const YAML::Node& value, const std::string& key, int least,
                   int most, int& place) {
  const int number = value.as<int>();
  if (number < least || number > most) {
    return refuse(file, value,
                  key + " is " + std::to_string(number) + ", allowed is " + std::to_string(least) + " to " +
                      std::to_string(most));
  }
  place = number;
  return {};
}

}  // namespace

Result<NetworkSettings> read_network_settings(const std::string& file) {
  YAML::Node top;
  try {
    top = YAML::LoadFile(file);
  } catch (const YAML::BadFile&) {
    return Error{ErrorCode::kNotFound, "network file " + file + " cannot be read"};
  } catch (const YAML::Exception& failure) {
    return Error{ErrorCode::kInvalidArgument, "network file " + file + ": " + failure.what()};
  }
  if (!top.IsMap()) {
    return Error{ErrorCode::kInvalidArgument, "network file " + file + " holds no 'key: value' lines"};
  }
  NetworkSettings settings;
  bool has_security = false;
  std::optional<YAML::Node> packet;
  for (const auto& entry : top) {
    const YAML::Node& value = entry.second;
    try {
      const auto key = entry.first.as<std::string>();
      Status status;
      if (key == "interface") {
        status = choose_interface(file, value, settings);
      } else if (key == "peers") {
        status = read_peers(file, value, settings);
      } else if (key == "processes_per_computer") {
        status = read_number(file, value, key, 1, 100, settings.processes_per_computer);
      } else if (key == "largest_packet_bytes") {
        packet = value;
        status = read_number(file, value, key, 1000, kLargestPacket_bytes, settings.largest_packet_bytes);
      } else if (key == "repair_pictures") {
        settings.repair_pictures = value.as<bool>();
      } else if (key == "security") {
        has_security = true;
        const auto folder = value.as<std::string>();
        settings.security_folder = folder == "none" ? "" : folder;
      } else {
        status = refuse(file, entry.first,
                        "'" + key +
                            "' is not allowed; there are interface, peers, security, processes_per_computer, "
                            "largest_packet_bytes, repair_pictures");
      }
      if (!status) {
        return status.error();
      }
    } catch (const YAML::Exception&) {
      return refuse(file, value, "'" + YAML::Dump(value) + "' is not understood");
    }
  }
  if (settings.address.empty()) {
    return refuse(file, top,
                  "the key interface is missing: the network interface to use, by name or address");
  }
  if (!has_security) {
    return refuse(file, top,
                  "the key security is missing: the folder of the keys that 'nido security init' made, or "
                  "none if everybody on this network may read and command the robot");
  }
  if (!settings.security_folder.empty()) {
    if (!packet) {
      settings.largest_packet_bytes = kLargestPacket_bytes;
    } else if (settings.largest_packet_bytes < kCertificates_bytes) {
      return refuse(file, *packet,
                    "largest_packet_bytes is " + std::to_string(settings.largest_packet_bytes) +
                        ", with keys " + std::to_string(kCertificates_bytes) +
                        " at least: processes show each other their certificates in one packet");
    }
  }
  return settings;
}

Result<std::optional<NetworkSettings>> network_settings_from_environment() {
  const char* const file = std::getenv("NIDO_NETWORK");  // NOLINT(concurrency-mt-unsafe): nobody sets it here
  if (file == nullptr || *file == '\0') {
    return std::optional<NetworkSettings>();
  }
  auto settings = read_network_settings(file);
  if (!settings) {
    return Error{settings.error().code, "NIDO_NETWORK: " + settings.error().message};
  }
  return std::optional(std::move(settings).value());
}

}  // namespace nido
