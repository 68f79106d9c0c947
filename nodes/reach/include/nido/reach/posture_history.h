#pragma once

#include <deque>
#include <optional>
#include <utility>

#include "nido/reach/arm_chain.h"

namespace nido::reach {

// Encoders of the last second or so, oldest first, times in s: an image shows the body as it stood when it
// was taken.
using PostureHistory = std::deque<std::pair<double, Joints>>;

// Encoders at a time in the past, linear between two entries; nothing if the time is not within the history.
std::optional<Joints> posture_at(const PostureHistory& history, double time_s);

}  // namespace nido::reach
