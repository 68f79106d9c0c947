#pragma once

// Ports without detours, for those who count microseconds and allocations (docs/ports.md). Heavy, as
// typed_port.h: for .cpp files that open ports.

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "nido/middleware/typed_port.h"

namespace nido {

// What is known of a message when it arrives. Valid during the call.
struct Arrival {
  const std::string& source;  // name of the output port
  Time source_time;           // when it was written: wall clock of the writer's computer
  std::uint64_t sequence = 0;
};

// From now on `handler` gets each message of this input at once, on the thread that receives it, one call at
// a time; nothing is kept for take(). The handler may write to ports; it may not wait for messages, call
// services, or open or close ports. kInvalidArgument for a second handler; kUnsupported in
// lockstep, where messages belong to ticks, and for a port that is not of Node.
using RawHandler = std::function<void(const void* message, const Arrival& arrival)>;
Status hand_over(RawInput& input, RawHandler handler);
// The same with the message as it travels: CDR with its four bytes of encapsulation. What comes from this
// computer lies where the output has put it, without a copy.
using PayloadHandler = std::function<void(std::span<const std::uint8_t> payload, const Arrival& arrival)>;
Status hand_over_payload(RawInput& input, PayloadHandler handler);

// Removes all kept messages; the newest, if there is one, is given to `swap`, which exchanges its content
// with the message of its own. So the memory of messages goes to and fro and none is allocated.
bool swap_latest(RawInput& input, const std::function<void(void* message)>& swap);

// A place in shared memory for a serialized message of up to `bytes` bytes, and its sending: what is filled
// in is what inputs on this computer read. The place is valid until the next call. kUnsupported for a port
// that is not of Node; kFailed without memory.
Result<std::span<std::uint8_t>> loan(RawOutput& output, std::size_t bytes);
Status write_loan(RawOutput& output, std::size_t bytes);

// An input that gets its handler before its first message.
Result<std::unique_ptr<RawInput>> open_with_handler(Node& node, const std::string& port_name,
                                                    const MessageType& type, Profile profile,
                                                    const std::function<Status(RawInput&)>& set_handler);

// An input that hands over: see hand_over.
template <class T>
Result<std::unique_ptr<RawInput>> open_direct_input(
    Node& node, const std::string& port_name, Profile profile,
    std::function<void(const T& message, const Arrival& arrival)> handler) {
  return open_with_handler(node, port_name, message_type_of<T>(), profile, [&](RawInput& input) {
    return hand_over(input, [handler = std::move(handler)](const void* message, const Arrival& arrival) {
      handler(*static_cast<const T*>(message), arrival);
    });
  });
}

// For loops: the newest message, without an allocation once all messages have been as large as they get.
template <class T>
bool take_latest_into(RawInput& input, T& message) {
  return swap_latest(input, [&message](void* kept) { std::swap(message, *static_cast<T*>(kept)); });
}

}  // namespace nido
