#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace nido {

// Shared-memory files that DDS leaves in /dev/shm when its process is killed: fastrtps_*, sem.fastrtps_*,
// fast_datasharing_*.

// Removes those that no living process maps, holds open or has locked, and that are older than min_age_s.
// Files that belong to other users and cannot be judged stay. Safe against nido processes that start
// meanwhile. Returns what was removed.
std::vector<std::string> sweep_shared_memory(double min_age_s = 1.0);

// Held while this process joins a domain, so that no sweep takes a file between its opening and its mapping.
class SharedMemoryGuard {
 public:
  SharedMemoryGuard();
  ~SharedMemoryGuard();
  SharedMemoryGuard(const SharedMemoryGuard&) = delete;
  SharedMemoryGuard& operator=(const SharedMemoryGuard&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace nido
