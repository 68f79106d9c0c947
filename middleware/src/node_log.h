#pragma once

#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "nido/middleware/time.h"

namespace nido {

// The log of a node: printed at once, published by the housekeeping thread. Thread-safe.
class NodeLog {
 public:
  enum class Level { kDebug, kInfo, kWarning, kError };
  struct Line {
    Time time;
    Level level = Level::kInfo;
    std::string text;
  };
  explicit NodeLog(std::string node) : node_(std::move(node)) {}
  void add(Time time, Level level, const std::string& text);
  // What has not been published yet. When that is more than 1000 lines, the oldest are gone.
  std::vector<Line> take_unpublished();

 private:
  const std::string node_;
  std::mutex mutex_;
  std::deque<Line> unpublished_;
};

}  // namespace nido
