#pragma once

#include <cstdint>

namespace nido {

// A point in time of the injected clock: nanoseconds since its start (simulated) or the epoch (wall).
struct Time {
  std::int64_t ns = 0;
  [[nodiscard]] double seconds() const { return static_cast<double>(ns) * 1e-9; }
  static Time from_seconds(double s) { return {static_cast<std::int64_t>(s * 1e9 + (s < 0 ? -0.5 : 0.5))}; }
  auto operator<=>(const Time&) const = default;
};

}  // namespace nido
