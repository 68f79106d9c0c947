#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "nido/interfaces/clock.h"
#include "nido/interfaces/result.h"

namespace nido {

struct SafetyOptions {
  bool read_only = false;  // the robot is looked at, never commanded
  double heartbeat_s = 0;  // greatest time between two beats, once there was one; 0: none is wanted
  std::function<void(const std::string&)> report{};  // told in a sentence what happened; may be empty
};

// What holds for all boards of a robot at once: whether anything may be commanded. Thread-safe.
class Safety {
 public:
  // `clock` must outlive this.
  Safety(SafetyOptions options, const IClock& clock) : options_(std::move(options)), clock_(clock) {}

  // kFailed, with the reason and what ends it, while nothing may be commanded.
  [[nodiscard]] Status may_command() const;
  // True once the emergency stop is on; joints then stand where they are until reset().
  [[nodiscard]] bool is_stopped() const;
  void stop(const std::string& reason);
  void reset();
  // "I am still there": stops the robot when these end. Counted from the first one.
  void beat();
  // Looks whether the heartbeat has ended. Call it once a control period.
  void step_to(std::int64_t now_ns);

  // One line of text, for people and programs: stop [WHY], reset, beat, get state. The answer as everywhere:
  // [ok], [is] state ..., or [fail] "reason".
  [[nodiscard]] std::string reply(const std::string& line);

 private:
  const SafetyOptions options_;
  const IClock& clock_;
  mutable std::mutex mutex_;
  std::optional<std::string> stopped_;  // why
  std::optional<std::int64_t> beaten_ns_;
};

}  // namespace nido
