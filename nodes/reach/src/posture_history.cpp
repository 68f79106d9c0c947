#include "nido/reach/posture_history.h"

#include <algorithm>
#include <iterator>

namespace nido::reach {

std::optional<Joints> posture_at(const PostureHistory& history, double time_s) {
  if (history.empty() || time_s < history.front().first - 1e-6 || time_s > history.back().first + 0.02) {
    return std::nullopt;
  }
  const auto after = std::lower_bound(history.begin(), history.end(), time_s,
                                      [](const auto& entry, double t) { return entry.first < t; });
  if (after == history.begin()) return history.front().second;
  if (after == history.end()) return history.back().second;
  const auto before = std::prev(after);
  const double share = (time_s - before->first) / (after->first - before->first);
  return before->second + share * (after->second - before->second);
}

}  // namespace nido::reach
