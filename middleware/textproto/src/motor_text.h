#pragma once

#include <optional>

#include "line.h"
#include "nido/interfaces/control_board.h"

namespace nido {

// The words of the vocabulary that speak of motors, amplifiers, loops and calibration. Nothing: the line is
// about something else.
std::optional<text_line::Outcome<text_line::Values>> get_motors(const IControlBoard& board,
                                                                const text_line::Values& line);
std::optional<text_line::Outcome<text_line::Values>> set_motors(IControlBoard& board,
                                                                const text_line::Values& line);
// Lines that begin with neither get nor set: calj J ..., cald J, cal ..., park F.
std::optional<text_line::Outcome<text_line::Values>> order_motors(IControlBoard& board,
                                                                  const text_line::Values& line);
// As YARP's boards, the answers to some words tell no time.
bool tells_no_time(const text_line::Values& line);

}  // namespace nido
