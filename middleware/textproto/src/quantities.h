#pragma once

#include <optional>

#include "line.h"
#include "nido/interfaces/control_board.h"

// The numbers that a board has for each joint or motor: `get enc J`, `get encs`, `get torq rng J`, ...
namespace nido::text_line {

// What stands behind [is] WHAT; nothing when the line asks for something else.
[[nodiscard]] std::optional<Outcome<Values>> get_quantity(const IControlBoard& board, const Values& line);

}  // namespace nido::text_line
