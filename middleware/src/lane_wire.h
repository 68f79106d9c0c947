#pragma once

#include <fastdds/rtps/common/Guid.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <utility>

#include "fd.h"

namespace nido {

using Guid = eprosima::fastrtps::rtps::GUID_t;

// Lanes: how messages go between two ports of one machine. Each connection is a Unix socket of its own, of
// the kind that keeps messages apart (SOCK_SEQPACKET), from the process with the output to the one with the
// input. DDS finds the ports and carries what goes to other programs and other machines.
//
// The input connects and says hello with its own name and the output's. The output answers "start", tells
// what it keeps for late joiners, and from then on every message. A message of more than kMostInline_bytes
// lies in shared memory that has no name (memfd) and is passed along once; the input tells when it has been
// read. The kernel closes and forgets all that with its process, however that ends.

enum class FrameKind : std::uint32_t {
  kHello = 0x6e69646f,  // to the output: `writer`, `reader`
  kStart,               // to the input: it is known from here on
  kMessage,             // to the input: the payload follows
  kShared,              // to the input: the payload is in `slot`, whose file comes with its first use
  kRelease,             // to the output: `slot` has been read; slot_bytes 0: its file did not come along
  kBoard,  // to the input: a bell and a board come along (lane_board.h); it answers with the same
  kSync,   // to the input: everything up to `sequence` has been sent; it answers with the same
};

// The beginning of each packet; both ends are the same program version on the same machine.
struct FrameHeader {
  FrameKind kind = FrameKind::kHello;
  std::uint32_t size = 0;  // of the payload, bytes
  std::uint64_t sequence = 0;
  std::int64_t source_time_ns = 0;
  std::uint64_t related_sequence = 0;
  std::array<unsigned char, 16> related{};  // GUID; services: who waits for the answer
  std::array<unsigned char, 16> writer{};
  std::array<unsigned char, 16> reader{};
  std::uint32_t slot = 0;
  std::uint32_t slot_bytes = 0;
};

// a message that fits into the buffers of sockets many times
constexpr std::size_t kMostInline_bytes = 32768;

// Where in its shared memory a large message begins. A message has a short head, then what makes it large;
// that is then written somewhat before a page's end. Large blocks of memory that it is copied from begin
// right behind a page's beginning, and a copy to a place that lies a little further in its page than the
// source in its own is slow: the processor takes each read for one of what was just written (the lower twelve
// bits of the address are the same).
constexpr std::size_t kSlotHead_bytes = 3584;

inline std::array<unsigned char, 16> pack(const Guid& guid) {
  std::array<unsigned char, 16> bytes{};
  std::memcpy(bytes.data(), guid.guidPrefix.value, 12);
  std::memcpy(bytes.data() + 12, guid.entityId.value, 4);
  return bytes;
}
inline Guid unpack_guid(const std::array<unsigned char, 16>& bytes) {
  Guid guid;
  std::memcpy(guid.guidPrefix.value, bytes.data(), 12);
  std::memcpy(guid.entityId.value, bytes.data() + 12, 4);
  return guid;
}

// Where a participant listens for lanes: a name in Linux's abstract namespace, made of its GUID.
struct LaneAddress {
  sockaddr_un value{};
  socklen_t length = 0;
  explicit LaneAddress(const eprosima::fastrtps::rtps::GuidPrefix_t& prefix) {
    std::string name = "nido-lane/";
    for (const unsigned char byte : prefix.value) {
      std::array<char, 3> digits{};
      std::snprintf(digits.data(), digits.size(), "%02x", byte);
      name += digits.data();
    }
    value.sun_family = AF_UNIX;
    std::memcpy(value.sun_path + 1, name.data(), name.size());
    length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  }
  [[nodiscard]] const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&value); }
};

}  // namespace nido
