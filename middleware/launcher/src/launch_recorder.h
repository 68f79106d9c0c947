#pragma once

#include <string>

#include "nido/interfaces/result.h"
#include "nido/launcher/app.h"

namespace nido {

inline constexpr const char* kRecorder = "recorder";

// The app with one process more, which is there before all others and ends after them. In lockstep it takes
// part in every tick, so that it gets every message. `wanted`: the file. Refuses one in a folder that is not
// there, and an app with such a process of its own.
Status add_recorder(App& app, const std::string& wanted);

}  // namespace nido
