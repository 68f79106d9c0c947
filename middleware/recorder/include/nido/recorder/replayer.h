#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"
#include "nido/middleware/node.h"
#include "nido/recorder/mcap_reader.h"

namespace nido {

struct ReplayOptions {
  std::optional<double> rate = 1.0;  // recorded seconds in a second, > 0; none: as fast as it goes
  std::vector<std::string> ports;    // as in RecorderOptions; empty: every port of the file
  std::vector<std::string> except;
  double from_s = 0;  // since the file's first message
  std::optional<double> to_s;
  bool loop = false;
  // How many inputs each port waits for before the first message; 0: until no more inputs come.
  std::size_t readers = 0;
  double wait_s = 10;     // for these
  double linger_s = 0.5;  // that the ports stay after the last message, for what is still under way
};

// Publishes what an MCAP file holds, byte for byte, on the ports of the same names. Not thread-safe.
class Replayer {
 public:
  // `node`: writes the ports; its clock is wall, or lockstep: then either it owns the clock and its members
  // (parameter lockstep.nodes) take part in every tick of the recording (run()), or it is a member itself and
  // says in each tick what was said in it (take_tick()). `side`: a hidden node for types that
  // nodes use themselves. Both outlive the replayer, and no other node of this process uses the types.
  // kTaken if a port has an owner, kNotFound if no port of the file is asked for, kUnsupported for messages
  // that are not CDR.
  static Result<std::unique_ptr<Replayer>> open(Node& node, Node& side, std::unique_ptr<mcap::Reader> reader,
                                                ReplayOptions options);
  virtual ~Replayer() = default;

  struct Progress {
    std::uint64_t messages = 0;
    std::uint64_t failed = 0;  // that a port of profile command could not keep for its readers
    double at_s = 0;           // since the file's first message
  };
  // Until the end of the file, or until is_stopped(), which is asked at least every 50 ms. kTimeout if the
  // inputs that were asked for did not come.
  virtual Status run(const std::function<bool(const Progress&)>& is_stopped) = 0;
  // In each tick of a clock that somebody else owns: writes what was recorded after the tick `now` up to the
  // next one, which is what was written in it in a run that was recorded in lockstep. What is older at the
  // first call is left out; after the file's end there is nothing to write.
  virtual Status take_tick(Time now, Time next) = 0;
  [[nodiscard]] virtual const Progress& progress() const = 0;
  [[nodiscard]] virtual std::vector<std::string> ports() const = 0;
};

}  // namespace nido
