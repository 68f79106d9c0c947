#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace nido {

// Shared-memory files that programs with Fast DDS leave in /dev/shm when they are killed: fastrtps_*,
// sem.fastrtps_*, fast_datasharing_*. nido's own processes make none.

// Removes those that no living process maps, holds open or has locked, and that are older than min_age_s.
// Files that belong to other users and cannot be judged stay. Returns what was removed.
std::vector<std::string> sweep_shared_memory(double min_age_s = 1.0);

}  // namespace nido
