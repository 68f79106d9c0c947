#include "node_log.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace nido {

void NodeLog::add(Time time, Level level, const std::string& text) {
  constexpr const char* kWords[] = {"debug", "info", "warning", "error"};
  // one event, one line
  std::string line = text;
  std::replace(line.begin(), line.end(), '\n', ' ');
  const std::lock_guard lock(mutex_);
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody sets the environment here
  if (level != Level::kDebug || std::getenv("NIDO_DEBUG") != nullptr) {
    const std::string printed = "[" + node_ + "] " + kWords[static_cast<int>(level)] + ": " + line + "\n";
    std::fwrite(printed.data(), 1, printed.size(), stdout);
    std::fflush(stdout);
  }
  unpublished_.push_back({time, level, std::move(line)});
  if (unpublished_.size() > 1000) {
    unpublished_.pop_front();
  }
}

std::vector<NodeLog::Line> NodeLog::take_unpublished() {
  const std::lock_guard lock(mutex_);
  std::vector<Line> lines(unpublished_.begin(), unpublished_.end());
  unpublished_.clear();
  return lines;
}

}  // namespace nido
