#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/middleware/time.h"

namespace nido {

// How messages of a port travel (docs/ports.md).
enum class Profile {
  kSensor,   // best effort, latest only, never blocks the writer
  kState,    // reliable, latest, late joiners get the last one
  kCommand,  // reliable, keeps all, loss is an error that the sender sees
  kEvent,    // reliable, keeps the last N
};

// Counters of one connection that ends at an input port. What a Directory tells of other nodes has no `late`
// and no `delays`: `nido port delay` asks them for those.
struct ConnectionCounters {
  std::string source;          // name of the output port
  bool live = false;           // the source exists now
  std::uint64_t received = 0;  // messages
  std::uint64_t lost = 0;   // messages that the source wrote and this port never got, or pushed out untaken
  std::uint64_t bytes = 0;  // of the received messages, serialized
  // Received messages that came when the next one of their rhythm was due already: their delay was longer
  // than the time between writing them and the one before.
  std::uint64_t late = 0;
  // Received messages by wall time from writing to arrival: [0] less than 1 us, [i] from 2^(i-1) to less than
  // 2^i us, the last one whatever took longer (from 17 s). Between computers it is as exact as their clocks
  // agree.
  std::array<std::uint64_t, 26> delays{};
};

// A message with what is known of its journey.
template <class T>
struct Received {
  T message;
  std::string source;          // name of the output port
  Time source_time;            // when it was written: wall clock of the writer's computer
  std::uint64_t sequence = 0;  // 1 for the first message that the source wrote
};

// A port that publishes messages of type T. Made by Node::open_output. Not thread-safe: one thread writes.
template <class T>
class Output {
 public:
  virtual ~Output() = default;
  // Sends one message. Fails only for profile command, when the message could not be kept for every reader.
  virtual Status write(const T& message) = 0;
  // Number of input ports that are connected now.
  [[nodiscard]] virtual std::size_t reader_count() const = 0;
  // Waits until at least `count` input ports are connected; false if that did not happen within timeout_s of
  // wall time.
  virtual bool wait_for_readers(std::size_t count, double timeout_s) = 0;
  [[nodiscard]] virtual const std::string& name() const = 0;
};

// A port that takes messages of type T from any number of outputs. Made by Node::open_input.
// Messages arrive on a middleware thread and are kept here until they are taken: all functions are
// thread-safe.
template <class T>
class Input {
 public:
  virtual ~Input() = default;
  // Removes and returns the oldest kept message; nothing if there is none.
  virtual std::optional<T> take() = 0;
  // The same with source, time and sequence number.
  virtual std::optional<Received<T>> take_received() = 0;
  // Removes all kept messages and returns the newest; nothing if there is none.
  virtual std::optional<T> take_latest() = 0;
  // Waits until a message is kept here; false if none came within timeout_s of wall time. Not for nodes in
  // lockstep.
  virtual bool wait_for_message(double timeout_s) = 0;
  // Waits until at least `count` sources are connected and exist; false if not so within timeout_s of wall
  // time.
  virtual bool wait_for_sources(std::size_t count, double timeout_s) = 0;
  // Connects to an output by name, now or as soon as it appears. Connecting twice is no error.
  virtual Status connect(const std::string& output_name) = 0;
  virtual Status disconnect(const std::string& output_name) = 0;
  [[nodiscard]] virtual std::vector<ConnectionCounters> connections() const = 0;
  [[nodiscard]] virtual const std::string& name() const = 0;
};

}  // namespace nido
