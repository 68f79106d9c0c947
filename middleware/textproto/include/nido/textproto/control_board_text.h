#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "nido/interfaces/control_board.h"

namespace nido {

// Answers lines of the control-board vocabulary (docs/control_board.md) for one board: the words that iCub
// users type and that YARP programs send. Degrees, deg/s, N m and percent of duty cycle at this boundary.
//
//     get encs              ->  [is] encs (0.0 12.5 ...) [tsta] 7 1.230000 [ok]
//     set pos 3 45          ->  [ok]
//     set pos 99 45         ->  [fail] "joint 99 does not exist: joints are 0..15"
//     get encz              ->  [fail] "'get encz': 'encz' cannot be got: did you mean 'get encs'?"
//     dance                 ->  [nak] "..."
//
// A line that is refused changes nothing. Thread-safe.
class ControlBoardText {
 public:
  // `board` must outlive this object.
  explicit ControlBoardText(IControlBoard& board) : board_(board) {}

  // Never throws and never fails: what is wrong is said in the answer.
  [[nodiscard]] std::string reply(const std::string& line);

  // What `help` answers: [many] and one string for each form.
  [[nodiscard]] static const std::string& help();

 private:
  IControlBoard& board_;
  std::atomic<std::uint64_t> count_{0};  // of the [tsta] stamps
};

// The four letters of a mode on this side: idl, pos, posd, vel, torq, ipwm, hwfa.
[[nodiscard]] std::string mode_word(ControlMode mode);
// The inverse; nothing for any other word.
[[nodiscard]] std::optional<ControlMode> mode_from_word(std::string_view word);

}  // namespace nido
