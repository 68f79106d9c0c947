#include "nido/middleware/pacer.h"

#include <thread>

namespace nido {

void Pacer::wait(Time now) {
  if (!rate_) {
    return;
  }
  const auto wall_now = std::chrono::steady_clock::now();
  if (!started_) {
    started_ = true;
    start_ = now;
    wall_start_ = wall_now;
    return;
  }
  const std::chrono::duration<double> due_after(static_cast<double>(now.ns - start_.ns) * 1e-9 / *rate_);
  const auto due = wall_start_ + std::chrono::duration_cast<std::chrono::steady_clock::duration>(due_after);
  if (wall_now > due + std::chrono::milliseconds(100)) {
    start_ = now;
    wall_start_ = wall_now;
    return;
  }
  std::this_thread::sleep_until(due);
}

void Pacer::restart(std::optional<double> rate) {
  rate_ = rate;
  started_ = false;
}

}  // namespace nido
