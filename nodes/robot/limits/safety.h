#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "nido/interfaces/clock.h"
#include "nido/interfaces/result.h"

namespace nido {

// What the emergency stop does to a joint.
enum class StopAction {
  kHold,  // it stays where it is, in mode position
  kIdle,  // its motor is switched off, as by the fault button of an iCub
};

struct SafetyOptions {
  bool read_only = false;  // the robot is looked at, never commanded
  StopAction action = StopAction::kHold;
  double heartbeat_s = 0;  // greatest time between two beats of a source that has beaten; 0: none is wanted
  std::string node = "robot";                        // of the sentence that says what ends a stop
  std::function<void(const std::string&)> report{};  // told in a sentence what happened; may be empty
};

// What holds for all boards of a robot at once: whether anything may be commanded. The emergency stop stays
// on, whatever caused it, until somebody clears it. Thread-safe.
class Safety {
 public:
  // `clock` must outlive this.
  Safety(SafetyOptions options, const IClock& clock) : options_(std::move(options)), clock_(clock) {}

  // kFailed, with the reason and what ends it, while nothing may be commanded.
  [[nodiscard]] Status may_command() const;
  [[nodiscard]] StopAction action() const { return options_.action; }
  // Why the emergency stop is on; nothing while it is off.
  [[nodiscard]] std::optional<std::string> stopped() const;
  // `reason` of a stop that is on already stays.
  void stop(const std::string& reason);
  void clear();
  // "I am still there": the robot stops when the beats of a source end. Counted from its first one; after
  // clear() from the next one.
  void beat(const std::string& source);
  // Looks whether a heart has ended. Call it once a control period.
  void step_to(std::int64_t now_ns);

  // One line of text, for people and programs: clear, beat, state; anything else, also nothing, stops the
  // robot and is the reason: who is in a hurry need not remember words. The answer as everywhere: [ok], or
  // [is] state running|stopped|readonly "WHY" (whose hearts are heard) [ok].
  [[nodiscard]] std::string reply(const std::string& line);

 private:
  const SafetyOptions options_;
  const IClock& clock_;
  mutable std::mutex mutex_;
  std::optional<std::string> stopped_;         // why
  std::map<std::string, std::int64_t> beats_;  // newest of each source
};

}  // namespace nido
