#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

namespace nido {

// Shared-memory files that Fast DDS left behind for processes that live no more: files of this user in
// `folder` whose names begin as Fast DDS's do, older than `age`, that no living process has mapped or open.
// The age guards files that a process is just making. Processes in other containers that share /dev/shm are
// not seen.
std::vector<std::string> stale_shared_memory(const std::string& folder = "/dev/shm",
                                             std::chrono::milliseconds age = std::chrono::seconds(1));

// Removes them. Returns how many were removed.
std::size_t sweep_stale_shared_memory(const std::string& folder = "/dev/shm",
                                      std::chrono::milliseconds age = std::chrono::seconds(1));

}  // namespace nido
