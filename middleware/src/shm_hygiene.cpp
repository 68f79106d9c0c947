#include "nido/middleware/shm_hygiene.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <set>

namespace nido {

namespace {

constexpr const char* kFolder = "/dev/shm";

std::vector<std::string> entries_of(const std::string& folder) {
  std::vector<std::string> names;
  if (DIR* dir = opendir(folder.c_str())) {
    // each caller has its own stream, which readdir may use safely
    while (const dirent* entry = readdir(dir)) {  // NOLINT(concurrency-mt-unsafe)
      names.emplace_back(entry->d_name);
    }
    closedir(dir);
  }
  return names;
}

bool is_of_dds(const std::string& name) {
  return name.starts_with("fastrtps_") || name.starts_with("sem.fastrtps_") ||
         name.starts_with("fast_datasharing_");
}

// somebody holds a lock on it, also somebody whose process we cannot see (another container)
bool is_locked(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (fd < 0) {
    return true;  // cannot be judged
  }
  const bool locked = flock(fd, LOCK_EX | LOCK_NB) != 0;
  close(fd);
  return locked;
}

// files in /dev/shm that some process maps or holds open, as far as we may see
std::set<std::string> files_in_use() {
  std::set<std::string> used;
  const std::string prefix = std::string(kFolder) + "/";
  for (const std::string& pid : entries_of("/proc")) {
    if (pid.empty() || std::isdigit(static_cast<unsigned char>(pid[0])) == 0) {
      continue;
    }
    const std::string folder = "/proc/" + pid;
    std::ifstream maps(folder + "/maps");
    for (std::string line; std::getline(maps, line);) {
      const auto at = line.find(prefix);
      if (at != std::string::npos) {
        used.insert(line.substr(at + prefix.size()));
      }
    }
    for (const std::string& fd : entries_of(folder + "/fd")) {
      char target[512];
      const ssize_t length = readlink((folder + "/fd/" + fd).c_str(), target, sizeof target);
      const std::string path(target, length > 0 ? static_cast<std::size_t>(length) : 0);
      if (path.starts_with(prefix)) {
        used.insert(path.substr(prefix.size()));
      }
    }
  }
  return used;
}

}  // namespace

std::vector<std::string> sweep_shared_memory(double min_age_s) {
  // candidates first: mostly there are none, and then nothing else is looked at
  struct Candidate {
    std::string name;
    std::string path;
  };
  std::vector<Candidate> candidates;
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  for (const std::string& name : entries_of(kFolder)) {
    struct stat status {};
    const std::string path = std::string(kFolder) + "/" + name;
    if (!is_of_dds(name) || lstat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) {
      continue;
    }
    const double age_s = static_cast<double>(now.tv_sec - status.st_ctim.tv_sec) +
                         static_cast<double>(now.tv_nsec - status.st_ctim.tv_nsec) * 1e-9;
    if (age_s >= min_age_s && (geteuid() == 0 || status.st_uid == geteuid())) {
      candidates.push_back({name, path});
    }
  }
  if (candidates.empty()) {
    return {};
  }

  std::vector<std::string> removed;
  const std::set<std::string> used = files_in_use();
  // a lock on any file of a family ("fastrtps_port7411", "fastrtps_port7411_el",
  // "sem.fastrtps_port7411_mutex") keeps it all
  std::set<std::string> locked_families;
  const auto family_of = [](std::string name) {
    name = name.starts_with("sem.") ? name.substr(4) : name;
    for (const char* tail : {"_el", "_sl", "_mutex"}) {
      if (name.ends_with(tail)) {
        name.resize(name.size() - std::char_traits<char>::length(tail));
      }
    }
    return name;
  };
  for (const Candidate& candidate : candidates) {
    if (used.contains(candidate.name) || is_locked(candidate.path)) {
      locked_families.insert(family_of(candidate.name));
    }
  }
  for (const Candidate& candidate : candidates) {
    if (!locked_families.contains(family_of(candidate.name)) && unlink(candidate.path.c_str()) == 0) {
      removed.push_back(candidate.name);
    }
  }
  return removed;
}

}  // namespace nido
