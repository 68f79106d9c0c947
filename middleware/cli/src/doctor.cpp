#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <thread>

#include "nido/launcher/app.h"
#include "nido/launcher/paths.h"
#include "nido/launcher/suggest.h"
#include "nido/middleware/network.h"
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

// Processes find each other by a packet to a group of addresses: does one come back on this interface?
bool hears_itself(in_addr interface) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in any{};
  any.sin_family = AF_INET;
  socklen_t length = sizeof any;
  ip_mreq group{};
  inet_pton(AF_INET, "239.255.0.1", &group.imr_multiaddr);
  group.imr_interface = interface;
  const unsigned char loop = 1;
  bool heard = bind(fd, reinterpret_cast<sockaddr*>(&any), sizeof any) == 0 &&
               getsockname(fd, reinterpret_cast<sockaddr*>(&any), &length) == 0 &&
               setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) == 0 &&
               setsockopt(fd, IPPROTO_IP, IP_MULTICAST_IF, &interface, sizeof interface) == 0 &&
               setsockopt(fd, IPPROTO_IP, IP_MULTICAST_LOOP, &loop, sizeof loop) == 0;
  any.sin_addr = group.imr_multiaddr;
  heard = heard && sendto(fd, "nido", 4, 0, reinterpret_cast<sockaddr*>(&any), sizeof any) == 4;
  pollfd ready{fd, POLLIN, 0};
  heard = heard && poll(&ready, 1, 500) == 1;
  close(fd);
  return heard;
}

// The network beyond this computer, as NIDO_NETWORK says.
Finding describe_network(const NetworkSettings& network) {
  const std::string where = fmt::format(
      "processes talk on {} ({}), as NIDO_NETWORK says, with {}, without multicast", network.interface_name,
      network.address, network.peers.empty() ? "no other computer" : join_words(network.peers));
  if (!network.security_folder.empty())
    return {"network", Health::kGood, where + "; encrypted, with the keys of " + network.security_folder, ""};
  return {"network", Health::kDoubtful,
          where + "; security is none: everybody on that network can read and command the robot",
          "only for a network of which you know every computer; else: nido security init"};
}

// What the kernel lets a socket hold of what has come and was not taken yet.
Finding check_sockets() {
  // pictures of two cameras at once, twice
  constexpr long kEnough_bytes = 2'000'000;
  std::ifstream file("/proc/sys/net/core/rmem_max");
  long bytes = 0;
  if (!(file >> bytes)) return {"sockets", Health::kGood, "the system does not say how much they hold", ""};
  const std::string text = fmt::format("one holds up to {} bytes that have come", bytes);
  if (bytes >= kEnough_bytes) return {"sockets", Health::kGood, text, ""};
  return {"sockets", Health::kDoubtful, text + ": pictures from other computers will be lost",
          "sysctl -w net.core.rmem_max=4194304; needless where nothing comes from other computers"};
}

Finding check_network() {
  const auto settings = network_settings_from_environment();
  if (!settings)
    return {"network", Health::kBad, settings.error().message, "correct that file, or unset NIDO_NETWORK"};
  if (settings->has_value()) return describe_network(**settings);
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return {"network", Health::kBad, "the interfaces cannot be listed", ""};
  std::string loopback;
  in_addr loopback_address{};
  std::set<std::string> others;
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET || (one->ifa_flags & IFF_UP) == 0)
      continue;
    if ((one->ifa_flags & IFF_LOOPBACK) != 0) {
      loopback = one->ifa_name;
      loopback_address = reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr;
    } else {
      others.insert(one->ifa_name);
    }
  }
  freeifaddrs(list);
  if (loopback.empty())
    return {"network", Health::kBad, "there is no loopback interface: processes do not find each other",
            "ip link set lo up"};
  if (!hears_itself(loopback_address))
    return {"network", Health::kBad,
            fmt::format("a packet to 239.255.0.1 does not come back on {}: processes do not find each other",
                        loopback),
            fmt::format("ip link set {} multicast on; let the firewall pass {}", loopback, loopback)};
  return {"network", Health::kGood,
          fmt::format(
              "processes find each other on {} (127.0.0.1), which is there on every machine{}", loopback,
              others.empty() ? "" : fmt::format("; also up: {}", join_words({others.begin(), others.end()}))),
          ""};
}

Finding check_clocks() {
  using std::chrono::steady_clock;
  double worst_s = 0;
  const auto wall = std::chrono::system_clock::now();
  const auto begin = steady_clock::now();
  for (int i = 0; i < 20; ++i) {
    const auto start = steady_clock::now();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    worst_s = std::max(worst_s, std::chrono::duration<double>(steady_clock::now() - start).count());
  }
  const double step_s = std::chrono::duration<double>(std::chrono::system_clock::now() - wall).count() -
                        std::chrono::duration<double>(steady_clock::now() - begin).count();
  constexpr std::int64_t kSeconds2024 = 1'704'067'200;
  if (std::chrono::duration_cast<std::chrono::seconds>(wall.time_since_epoch()).count() < kSeconds2024) {
    return {"clocks", Health::kBad,
            "the computer's clock is before 2024: stamps and recordings would be wrong",
            "set it: date -s, or timedatectl set-ntp true"};
  }
  if (std::abs(step_s) > 0.05) {
    return {
        "clocks", Health::kDoubtful,
        fmt::format("the computer's clock was set by {:.2f} s just now: delays are wrong until it is steady",
                    step_s),
        "let it be slewed, not stepped (chrony, timedatectl)"};
  }
  if (worst_s > 0.02) {
    return {"clocks", Health::kDoubtful,
            fmt::format("a sleep of 1 ms took up to {:.0f} ms: this machine is busy", worst_s * 1e3),
            "runs in lockstep stay right, only slower; for --rate 1 free the machine"};
  }
  return {"clocks", Health::kGood, fmt::format("a sleep of 1 ms takes at most {:.1f} ms", worst_s * 1e3), ""};
}

// Runs and recordings are written below the current folder.
Finding check_disk() {
  struct statvfs info {};
  if (access(".", W_OK) != 0 || statvfs(".", &info) != 0) {
    return {"disk", Health::kDoubtful, "this folder cannot be written: runs leave their reports in ./out",
            "go to another folder, or say --out DIR"};
  }
  const double free_gb = static_cast<double>(info.f_bavail) * static_cast<double>(info.f_frsize) * 1e-9;
  if (free_gb < 1) {
    return {"disk", Health::kDoubtful,
            fmt::format("{:.2f} GB are free here: a recording takes up to 60 MB a second", free_gb),
            "remove old runs (out/), or say --out and --record with a folder on another disk"};
  }
  return {"disk", Health::kGood, fmt::format("{:.0f} GB are free here", free_gb), ""};
}

Finding check_config(const Places& places) {
  const auto names = config_names(places, "apps");
  for (const auto& name : names) {
    if (auto app = load_app((places.config / "apps" / (name + ".yaml")).string()); !app) {
      return {"config", Health::kBad, app.error().message, "correct that file"};
    }
  }
  return {"config", Health::kGood, fmt::format("{} apps in {}", names.size(), places.config.string()), ""};
}

Finding check_machine() {
  const unsigned cores = std::thread::hardware_concurrency();
  if (cores < 2)
    return {"processor", Health::kDoubtful, "one core: a run will be slow", "use a machine with two"};
  return {"processor", Health::kGood, fmt::format("{} cores", cores), ""};
}

Finding check_programs(const Places& places) {
  std::vector<std::string> missing;
  for (const char* name : {"nido-janitor", "nido-recorder", "nido-robot", "nido-vision", "nido-speech",
                           "nido-goal-selection", "nido-reach", "nido-grasp", "nido-judge"}) {
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
  std::vector<std::string> failed;
  std::vector<std::string> misfits;
  std::vector<std::string> dead;
  std::vector<std::string> lossy;
  std::size_t count = 0;
  const auto end_of = [](const std::string& node, const PortDescription& port) {
    return fmt::format("{} (node {}, {}, profile {})", port.name, node, port.type, port.profile);
  };
  for (const auto& node : session->directory->nodes()) {
    count += node.ports.size();
    if (node.state == "failed") failed.push_back(fmt::format("{} ({})", node.name, node.detail));
    for (const auto& port : node.ports) {
      if (port.direction != "input") continue;
      for (const auto& counters : port.connections) {
        const auto source = session->directory->owner_of(counters.source);
        if (!counters.live && source) {
          misfits.push_back(end_of(source->node.name, source->port) + " and " + end_of(node.name, port));
        } else if (!counters.live) {
          dead.push_back(counters.source + " -> " + port.name);
        } else if (counters.lost > 0) {
          lossy.push_back(fmt::format("{} of {} on {} -> {}", counters.lost,
                                      counters.lost + counters.received, counters.source, port.name));
        }
      }
    }
  }
  if (!failed.empty())
    return {"ports", Health::kBad, "failed nodes: " + join_words(failed), "see their logs"};
  if (!misfits.empty())
    return {"ports", Health::kBad, "both ends are there and do not connect: " + join_words(misfits, "; "),
            "give both the same type and profile"};
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
  if (!dead.empty())
    return {"ports", Health::kDoubtful, "connections whose output is not there: " + join_words(dead),
            "start the node that writes it, or nido port disconnect"};
  if (!lossy.empty())
    return {
        "ports", Health::kDoubtful, "messages were lost: " + join_words(lossy),
        "a reader that is too slow: give it less to do, a longer period or a queue; sensor ports may lose"};
  return {"ports", Health::kGood,
          fmt::format("{} ports of {} nodes in domain {}", count, session->directory->nodes().size(),
                      common.domain),
          ""};
}

}  // namespace

int doctor(const Common& common) {
  auto places = find_places();
  if (!places) return fail(common, places.error());
  const std::vector<Finding> findings = {check_packages(*places),
                                         check_programs(*places),
                                         check_machine(),
                                         check_config(*places),
                                         check_disk(),
                                         check_shared_memory(),
                                         check_stale_files(),
                                         check_network(),
                                         check_sockets(),
                                         check_clocks(),
                                         check_ports(common)};
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
