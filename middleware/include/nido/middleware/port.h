#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// How messages of a port travel (docs/ports.md).
enum class Profile {
  kSensor,   // best effort, latest only, never blocks the writer
  kState,    // reliable, latest, late joiners get the last one
  kCommand,  // reliable, keeps all, loss is an error that the sender sees
  kEvent,    // reliable, keeps the last N
};

// Counters of one connection that ends at an input port.
struct ConnectionCounters {
  std::string source;          // name of the output port
  bool live = false;           // the source exists now
  std::uint64_t received = 0;  // messages
  std::uint64_t lost = 0;      // messages that the source wrote and this port never got
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
  [[nodiscard]] virtual const std::string& name() const = 0;
};

// A port that takes messages of type T from any number of outputs. Made by Node::open_input.
// Messages arrive on a middleware thread and are kept here until they are taken: all functions are thread-safe.
template <class T>
class Input {
 public:
  virtual ~Input() = default;
  // Removes and returns the oldest kept message; nothing if there is none.
  virtual std::optional<T> take() = 0;
  // Removes all kept messages and returns the newest; nothing if there is none.
  virtual std::optional<T> take_latest() = 0;
  // Connects to an output by name, now or as soon as it appears. Connecting twice is no error.
  virtual Status connect(const std::string& output_name) = 0;
  virtual Status disconnect(const std::string& output_name) = 0;
  [[nodiscard]] virtual std::vector<ConnectionCounters> connections() const = 0;
  [[nodiscard]] virtual const std::string& name() const = 0;
};

}  // namespace nido
