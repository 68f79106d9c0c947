#pragma once

#include <filesystem>
#include <string>

#include "nido/interfaces/result.h"

namespace nido::reach {

// Writes robot files of a body to which something has happened into a folder; the name for nido launch
// --robot. The nodes are not told: they go on with the body as it was drawn. `change`: "forearm", that of the
// hand becomes 2 cm longer; "eyes", somebody knocks against them, and both are tilted by 6 degrees.
Result<std::string> write_changed_robot(const std::string& change, const std::string& side,
                                        const std::filesystem::path& folder);

}  // namespace nido::reach
