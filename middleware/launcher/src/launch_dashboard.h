#pragma once

#include <string>

#include "nido/interfaces/result.h"
#include "nido/launcher/app.h"

namespace nido {

inline constexpr const char* kDashboard = "dashboard";

// The app with one process more, which shows the run on a page: it starts first, ends last, and takes no part
// in the lockstep; the run goes on without it. `wanted`: port of 127.0.0.1, "0" for a free one. Refuses a
// port that is no number or taken, in words, before anything is started.
Status add_dashboard(App& app, const std::string& wanted);

}  // namespace nido
