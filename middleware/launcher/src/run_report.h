#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace nido {

// How a run ended.
struct RunEnd {
  int exit_code = 1;
  std::string sentence;
};

// The outcome in the judge's report in the run's folder, which may have been written but not heard: the judge
// ended before its last message got here. Nothing if there is none, or the report is not whole.
std::optional<RunEnd> outcome_in_report(const std::filesystem::path& folder);

// Adds to the judge's report, if there is one, what only the launcher knows: the restarts of each process by
// its name, and how long the run took, in s.
void finish_report(const std::filesystem::path& folder,
                   const std::vector<std::pair<std::string, int>>& restarts, double wall_s);

}  // namespace nido
