#pragma once

#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// Runs `nido launch APP ARGUMENTS...` (the program beside this one) to its end. Its output goes to the file
// `log`. Ctrl-C reaches it as it reaches this process. kInterrupted if it was interrupted, kFailed with its
// exit code and the log's place if it did not do its job.
Status run_app(const std::string& app, const std::vector<std::string>& arguments, const std::string& log);

}  // namespace nido
