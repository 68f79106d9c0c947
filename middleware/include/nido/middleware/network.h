#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// Which computers the processes of a system talk to. Without these settings: this computer only, on
// 127.0.0.1. With them: those that are named, on one network interface, by explicit addresses and without
// multicast. All computers of a system have such a file, each with its own interface and the others as peers
// (docs/network.md).
struct NetworkSettings {
  std::string address;             // IPv4 address of this computer on the interface that is used
  std::string interface_name;      // "eth0", for people
  std::vector<std::string> peers;  // IPv4 addresses of the other computers
  // Processes that a computer may have in one domain. Each is asked for at a port number of its own, so that
  // no multicast is needed; 1 to 100.
  int processes_per_computer = 25;
  // Longer messages travel in pieces of this size; 1000 to 65500. What is larger than a packet of the network
  // (1500 bytes) is cut by the kernel, which loses all of it with one piece, keeps the others for half a
  // minute, and takes no more of that kind when they are many: where packets are lost, nothing large arrives
  // then. With keys it is 65500 unless the file says else, and 8000 at least: the certificates have to fit.
  // Holds for messages inside of the computer, too.
  int largest_packet_bytes = 1400;
  // Messages of profile sensor are sent again where packets of them were lost, as long as they are among the
  // newest. Holds for outputs and inputs of this computer; an input that wants it gets nothing from an output
  // that does not do it.
  bool repair_pictures = false;
  // Folder of the keys that `nido security init` made (key_store.h): messages are encrypted, and only those
  // with keys of the same authority take part. Empty: the wire is trusted (`security: none`).
  std::string security_folder;
};

// Reads a network file:
//   interface: eth0            # or its address
//   peers: [192.168.7.3]
//   security: none             # or the folder of the keys
// kInvalidArgument with file and line for what is not understood, for an interface that is not there and for
// peers that are not IPv4 addresses; kNotFound for a file that cannot be read.
Result<NetworkSettings> read_network_settings(const std::string& file);

// The file that the environment variable NIDO_NETWORK names; nothing when it is not set.
Result<std::optional<NetworkSettings>> network_settings_from_environment();

}  // namespace nido
