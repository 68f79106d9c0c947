#include "nido/launcher/shared_memory.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <set>

namespace nido {
namespace fs = std::filesystem;
namespace {

bool of_fast_dds(const std::string& name) {
  for (const char* prefix : {"fastrtps_", "fast_datasharing_", "sem.fastrtps_"}) {
    if (name.starts_with(prefix)) return true;
  }
  return false;
}

// Files of `folder` that a living process has mapped or open.
std::set<std::string> files_in_use(const std::string& folder) {
  std::set<std::string> used;
  std::error_code error;
  const std::string prefix = folder + "/";
  for (const auto& process :
       fs::directory_iterator("/proc", fs::directory_options::skip_permission_denied, error)) {
    const std::string pid = process.path().filename().string();
    if (!std::all_of(pid.begin(), pid.end(), [](unsigned char c) { return std::isdigit(c) != 0; })) continue;
    // open before mapped: a file goes from the one to the other
    std::error_code inner;
    for (const auto& fd : fs::directory_iterator(process.path() / "fd",
                                                 fs::directory_options::skip_permission_denied, inner)) {
      const fs::path target = fs::read_symlink(fd.path(), inner);
      if (!inner && target.string().starts_with(prefix)) used.insert(target.string());
    }
    std::ifstream maps(process.path() / "maps");
    for (std::string line; std::getline(maps, line);) {
      const std::size_t at = line.find(prefix);
      if (at != std::string::npos) used.insert(line.substr(at));
    }
  }
  return used;
}

}  // namespace

std::vector<std::string> stale_shared_memory(const std::string& folder, std::chrono::milliseconds age) {
  std::vector<std::string> candidates;
  std::error_code error;
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (!of_fast_dds(entry.path().filename().string())) continue;
    struct stat info {};
    if (lstat(entry.path().c_str(), &info) != 0 || !S_ISREG(info.st_mode) || info.st_uid != geteuid())
      continue;
    const auto age_ms =
        (now.tv_sec - info.st_ctim.tv_sec) * 1000 + (now.tv_nsec - info.st_ctim.tv_nsec) / 1000000;
    if (age_ms >= age.count()) candidates.push_back(entry.path().string());
  }
  if (candidates.empty()) return candidates;
  const auto used = files_in_use(folder);
  std::erase_if(candidates, [&used](const std::string& file) { return used.contains(file); });
  std::sort(candidates.begin(), candidates.end());
  return candidates;
}

std::size_t sweep_stale_shared_memory(const std::string& folder, std::chrono::milliseconds age) {
  std::size_t removed = 0;
  for (const auto& file : stale_shared_memory(folder, age)) {
    if (unlink(file.c_str()) == 0) ++removed;
  }
  return removed;
}

}  // namespace nido
