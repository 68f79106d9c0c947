#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <thread>

#include "nido/launcher/paths.h"
#include "nido/launcher/suggest.h"
#include "nido/middleware/shm_hygiene.h"
#include "verbs.h"

namespace nido::cli {
namespace fs = std::filesystem;
namespace {

enum class Health { kGood, kDoubtful, kBad };

struct Finding {
  std::string what;
  Health health = Health::kGood;
  std::string text;
  std::string mend;
};

// Packages of packages.txt that dpkg does not list as installed.
Finding check_packages(const Places& places) {
  std::ifstream list(places.config / "../packages.txt");
  if (!list) return {"packages", Health::kGood, "no package list here: this is an installation", ""};
  std::ifstream status("/var/lib/dpkg/status");
  if (!status)
    return {"packages", Health::kDoubtful, "not a Debian system: not checked",
            "install what packages.txt lists"};
  std::set<std::string> installed;
  std::string name;
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("Package: ")) name = line.substr(9);
    if (line == "Status: install ok installed" || line == "Status: hold ok installed") installed.insert(name);
  }
  std::vector<std::string> missing;
  int count = 0;
  for (std::string line; std::getline(list, line);) {
    const std::string package = line.substr(0, line.find_first_of(" #\t"));
    if (package.empty()) continue;
    ++count;
    if (!installed.contains(package)) missing.push_back(package);
  }
  if (missing.empty()) return {"packages", Health::kGood, fmt::format("all {} are installed", count), ""};
  return {"packages", Health::kBad, "missing: " + join_words(missing),
          "apt-get install " + join_words(missing, " ")};
}

Finding check_shared_memory() {
  struct statvfs info {};
  const std::string path = fmt::format("/dev/shm/nido-doctor-{}", getpid());
  std::ofstream file(path);
  const bool writable = static_cast<bool>(file);
  file.close();
  std::error_code error;
  fs::remove(path, error);
  if (!writable || statvfs("/dev/shm", &info) != 0) {
    return {"shared memory", Health::kBad, "/dev/shm cannot be written", "mount -t tmpfs tmpfs /dev/shm"};
  }
  const double free_mb = static_cast<double>(info.f_bavail) * static_cast<double>(info.f_frsize) * 1e-6;
  if (free_mb < 64) {
    return {"shared memory", Health::kBad,
            fmt::format("/dev/shm has {:.0f} MB free, a run needs 64", free_mb),
            "make it larger (mount -o remount,size=1G /dev/shm; a container: --shm-size=1g)"};
  }
  return {"shared memory", Health::kGood, fmt::format("/dev/shm has {:.0f} MB free", free_mb), ""};
}

Finding check_stale_files() {
  const auto swept = sweep_shared_memory();
  if (swept.empty()) return {"stale files", Health::kGood, "none", ""};
  return {"stale files", Health::kDoubtful,
          fmt::format("{} files of dead processes were in /dev/shm", swept.size()),
          "they were removed just now"};
}

Finding check_network() {
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return {"network", Health::kBad, "the interfaces cannot be listed", ""};
  bool loopback = false;
  std::set<std::string> up;
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET || (one->ifa_flags & IFF_UP) == 0)
      continue;
    up.insert(one->ifa_name);
    loopback = loopback || (one->ifa_flags & IFF_LOOPBACK) != 0;
  }
  freeifaddrs(list);
  if (!loopback)
    return {"network", Health::kBad, "there is no loopback interface: processes do not find each other",
            "ip link set lo up"};
  return {"network", Health::kGood, "up: " + join_words({up.begin(), up.end()}), ""};
}

Finding check_clocks() {
  using std::chrono::steady_clock;
  double worst_s = 0;
  for (int i = 0; i < 20; ++i) {
    const auto start = steady_clock::now();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    worst_s = std::max(worst_s, std::chrono::duration<double>(steady_clock::now() - start).count());
  }
  if (worst_s > 0.02) {
    return {"clocks", Health::kDoubtful,
            fmt::format("a sleep of 1 ms took up to {:.0f} ms: this machine is busy", worst_s * 1e3),
            "runs in lockstep stay right, only slower; for --rate 1 free the machine"};
  }
  return {"clocks", Health::kGood, fmt::format("a sleep of 1 ms takes at most {:.1f} ms", worst_s * 1e3), ""};
}

Finding check_machine() {
  const unsigned cores = std::thread::hardware_concurrency();
  if (cores < 2)
    return {"processor", Health::kDoubtful, "one core: a run will be slow", "use a machine with two"};
  return {"processor", Health::kGood, fmt::format("{} cores", cores), ""};
}

Finding check_programs(const Places& places) {
  std::vector<std::string> missing;
  for (const char* name : {"nido-janitor", "nido-robot", "nido-vision", "nido-speech", "nido-goal-selection",
                           "nido-reach", "nido-grasp", "nido-judge"}) {
    if (access((places.programs / name).c_str(), X_OK) != 0) missing.emplace_back(name);
  }
  if (missing.empty()) return {"programs", Health::kGood, "all are built", ""};
  return {"programs", Health::kBad, "not built: " + join_words(missing), "./run, or: ninja -C build"};
}

// Ports that write and read one topic with different types do not hear each other.
Finding check_ports(const Common& common) {
  auto session = join(common);
  if (!session) return {"ports", Health::kBad, session.error().message, ""};
  settle(*session->directory);
  std::map<std::string, std::set<std::string>> types;
  for (const auto& topic : session->directory->topics()) types[topic.topic].insert(topic.type);
  for (const auto& [topic, names] : types) {
    if (names.size() > 1) {
      return {
          "ports", Health::kBad,
          fmt::format("{} is used with different types: {}", topic, join_words({names.begin(), names.end()})),
          "make writer and reader agree"};
    }
  }
  std::vector<std::string> dead;
  std::size_t count = 0;
  for (const auto& node : session->directory->nodes()) {
    count += node.ports.size();
    for (const auto& port : node.ports) {
      if (port.direction != "input") continue;
      for (const auto& counters : port.connections) {
        if (!counters.live) dead.push_back(counters.source + " -> " + port.name);
      }
    }
  }
  if (!dead.empty())
    return {"ports", Health::kDoubtful, "connections whose output is not there: " + join_words(dead),
            "start the node that writes it, or nido port disconnect"};
  return {"ports", Health::kGood,
          fmt::format("{} ports of {} nodes in domain {}", count, session->directory->nodes().size(),
                      common.domain),
          ""};
}

}  // namespace

int doctor(const Common& common) {
  auto places = find_places();
  if (!places) return fail(places.error());
  const std::vector<Finding> findings = {check_packages(*places), check_programs(*places), check_machine(),
                                         check_shared_memory(),   check_stale_files(),     check_network(),
                                         check_clocks(),          check_ports(common)};
  bool bad = false;
  Json list = Json::array();
  for (const auto& finding : findings) {
    bad = bad || finding.health == Health::kBad;
    const char* health = finding.health == Health::kGood       ? "good"
                         : finding.health == Health::kDoubtful ? "doubtful"
                                                               : "bad";
    if (common.json) {
      list.push_back(
          {{"what", finding.what}, {"health", health}, {"text", finding.text}, {"mend", finding.mend}});
      continue;
    }
    fmt::print("{:<9} {:<14} {}\n", health, finding.what, finding.text);
    if (!finding.mend.empty()) fmt::print("{:<9} {:<14} mend: {}\n", "", "", finding.mend);
  }
  if (common.json) fmt::print("{}\n", list.dump(2));
  return bad ? 3 : 0;
}

}  // namespace nido::cli
