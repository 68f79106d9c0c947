#include "nido/middleware/pacer.h"

namespace nido {

std::optional<std::chrono::steady_clock::time_point> Pacer::due(Time now) {
  if (!rate_) {
    return std::nullopt;
  }
  const auto wall_now = std::chrono::steady_clock::now();
  if (!started_) {
    started_ = true;
    start_ = now;
    wall_start_ = wall_now;
    return std::nullopt;
  }
  const std::chrono::duration<double> due_after(static_cast<double>(now.ns - start_.ns) * 1e-9 / *rate_);
  const auto due = wall_start_ + std::chrono::duration_cast<std::chrono::steady_clock::duration>(due_after);
  if (wall_now > due + std::chrono::milliseconds(100)) {
    start_ = now;
    wall_start_ = wall_now;
    return std::nullopt;
  }
  return due;
}

void Pacer::restart(std::optional<double> rate) {
  rate_ = rate;
  started_ = false;
}

}  // namespace nido
