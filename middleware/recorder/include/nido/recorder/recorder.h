#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/middleware/directory.h"
#include "nido/middleware/node.h"
#include "nido/recorder/mcap_writer.h"

namespace nido {

struct RecorderOptions {
  std::string file;
  // Names of output ports; `*` and `?` stand for any text and any letter. Empty: every port. Those that are
  // not there yet are recorded when they appear.
  std::vector<std::string> ports;
  std::vector<std::string> except;
  // What may wait in memory to be written, at most. What comes beyond that is lost, and counted.
  std::size_t memory_bytes = std::size_t{256} << 20U;
  // Log times. kAuto: simulated if /clock is there when the recording begins.
  enum class Clock { kAuto, kWall, kSimulated } clock = Clock::kAuto;
  mcap::WriterOptions writer;
};

struct RecordedPort {
  std::string name;     // "/icubSim/head/state:o"
  std::string type;     // "sensor_msgs/msg/JointState"
  std::string profile;  // "state"
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;
  std::uint64_t lost = 0;     // written by the source, not in the file
  std::uint64_t last_ns = 0;  // log time of the newest message
  std::string refused;        // why it cannot be recorded; empty if it can
};

// Writes what output ports send into an MCAP file (docs/recording.md). Messages are taken as they travel, so
// their types need not be known. Thread-safe.
class Recorder {
 public:
  // `looker`: a hidden node whose clock is wall; `directory`: of that node. Both outlive the recorder.
  // `member`: none, or a node whose clock is lockstep and whose run() calls take_tick(): ports that take part
  // in the lockstep are read by it, so that none of their messages can be lost. kInvalidArgument for a port
  // name that is none or is that of an input.
  static Result<std::unique_ptr<Recorder>> open(Node& looker, Directory& directory, RecorderOptions options,
                                                Node* member = nullptr);
  virtual ~Recorder() = default;

  // Looks for new ports, takes what has come, writes. Call it about every 10 ms.
  virtual Status poll() = 0;
  // The same for the ports of the lockstep, in each of its ticks.
  virtual Status take_tick(Time now) = 0;
  // Takes what is left, writes how much was lost and the summary. The file reads without it, too.
  virtual Status close() = 0;

  // Every output of these nodes that shall be recorded is, and so is /clock: the first tick may come.
  [[nodiscard]] virtual bool follows(const std::vector<std::string>& nodes) = 0;

  [[nodiscard]] virtual std::vector<RecordedPort> ports() = 0;
  // Names that were asked for and have not appeared.
  [[nodiscard]] virtual std::vector<std::string> missing() = 0;
  [[nodiscard]] virtual bool on_simulated_time() const = 0;
  [[nodiscard]] virtual std::uint64_t file_bytes() = 0;
};

// Does one of the patterns (`*`, `?`) fit the port's name, with or without its ":o"?
bool port_matches(const std::string& port_name, const std::vector<std::string>& patterns);

// An existing file makes room: it is renamed to FILE~, over an older one of that name. kFailed if that cannot
// be done.
Status keep_old_file(const std::string& file);

}  // namespace nido
