#include "system_view.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <sstream>

namespace nido {
namespace {

constexpr std::string_view kRestarts = "restarts = ";
// longer than the period of announcements: a counter that stands still has rate 0
constexpr double kStill_s = 2.5;
constexpr std::size_t kMostRemembered = 200;

std::string host_name() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

}  // namespace

void SystemView::Rate::update(std::uint64_t now_count, SteadyClock::time_point now) {
  const double passed_s = std::chrono::duration<double>(now - since).count();
  if (!known || now_count < count) {
    *this = {now_count, now, 0, true};
  } else if (now_count > count ? passed_s > 0.4 : passed_s > kStill_s) {
    per_s = static_cast<double>(now_count - count) / passed_s;
    count = now_count;
    since = now;
  }
}

// CPU time and memory of a process of this computer.
void SystemView::measure(Process& process) {
  std::ifstream stat("/proc/" + std::to_string(process.node.pid) + "/stat");
  std::string text((std::istreambuf_iterator<char>(stat)), {});
  // the second field is a name, which may hold anything, in brackets
  const std::size_t end = text.rfind(')');
  if (end == std::string::npos) return;
  std::istringstream fields(text.substr(end + 1));
  std::string skipped;
  for (int i = 0; i < 11; ++i) fields >> skipped;
  std::uint64_t user = 0;
  std::uint64_t system = 0;
  fields >> user >> system;
  for (int i = 0; i < 8; ++i) fields >> skipped;
  std::uint64_t pages = 0;
  if (!(fields >> pages)) return;
  const auto now = SteadyClock::now();
  const double passed_s = std::chrono::duration<double>(now - process.measured).count();
  const std::uint64_t ticks = user + system;
  if (process.cpu_ticks > 0 && ticks >= process.cpu_ticks && passed_s > 0.2) {
    process.cpu =
        static_cast<double>(ticks - process.cpu_ticks) / static_cast<double>(sysconf(_SC_CLK_TCK)) / passed_s;
  }
  process.cpu_ticks = ticks;
  process.measured = now;
  process.memory_mb = static_cast<double>(pages) * static_cast<double>(sysconf(_SC_PAGESIZE)) * 1e-6;
}

void SystemView::look(const std::vector<NodeDescription>& nodes) {
  static const std::string own_host = host_name();
  const auto now = SteadyClock::now();
  for (auto& [name, process] : processes_) process.gone = true;
  for (const NodeDescription& node : nodes) {
    if (!processes_.contains(node.name) && processes_.size() >= kMostRemembered) continue;
    Process& process = processes_[node.name];
    if (process.node.pid != node.pid) process = {};
    process.node = node;
    process.gone = false;
    if (node.host == own_host) measure(process);
    for (const PortDescription& port : node.ports) {
      if (port.direction == "output") messages_[port.name].update(port.written, now);
      for (const auto& connection : port.connections) {
        if (port.direction == "input")
          bytes_[connection.source + " " + port.name].update(connection.bytes, now);
      }
    }
  }
  const auto forget_old = [](auto& rates) {
    if (rates.size() > 5000) rates.clear();
  };
  forget_old(messages_);
  forget_old(bytes_);
}

nlohmann::json SystemView::nodes() const {
  auto list = nlohmann::json::array();
  for (const auto& [name, process] : processes_) {
    int restarts = 0;
    for (const auto& parameter : process.node.parameters) {
      if (parameter.starts_with(kRestarts)) restarts = std::atoi(parameter.c_str() + kRestarts.size());
    }
    list.push_back({{"name", name},
                    {"pid", process.node.pid},
                    {"host", process.node.host},
                    {"state", process.gone ? "gone" : process.node.state},
                    {"detail", process.node.detail},
                    {"restarts", restarts},
                    {"cpu", process.gone ? 0.0 : process.cpu},
                    {"memory_mb", process.gone ? 0.0 : process.memory_mb}});
  }
  return list;
}

nlohmann::json SystemView::ports() const {
  auto list = nlohmann::json::array();
  const std::string own_stem = "/" + own_name_ + "/";
  // an output is told the size of its messages by those that read it
  std::map<std::string, double> bytes_of_output;
  for (const auto& [names, rate] : bytes_) {
    double& most = bytes_of_output[names.substr(0, names.find(' '))];
    most = std::max(most, rate.per_s);
  }
  for (const auto& [name, process] : processes_) {
    if (process.gone || name == own_name_) continue;
    for (const PortDescription& port : process.node.ports) {
      auto connections = nlohmann::json::array();
      for (const auto& connection : port.connections) {
        // this page's own look
        if (connection.source.starts_with(own_stem)) continue;
        nlohmann::json one = {{"name", connection.source}};
        if (port.direction == "input") {
          one["live"] = connection.live;
          one["lost"] = connection.lost;
          one["received"] = connection.received;
        }
        connections.push_back(std::move(one));
      }
      nlohmann::json row = {{"name", port.name}, {"direction", port.direction}, {"type", port.type},
                            {"node", name},      {"profile", port.profile},     {"connections", connections}};
      if (port.direction == "output") {
        if (const auto rate = messages_.find(port.name); rate != messages_.end())
          row["hz"] = rate->second.per_s;
        if (const auto rate = bytes_of_output.find(port.name); rate != bytes_of_output.end())
          row["bytes_s"] = rate->second;
      }
      list.push_back(std::move(row));
    }
  }
  return list;
}

std::vector<std::string> SystemView::ports_of(const std::string& direction, const std::string& type) const {
  std::vector<std::string> names;
  for (const auto& [name, process] : processes_) {
    if (process.gone || name == own_name_) continue;
    for (const PortDescription& port : process.node.ports) {
      if (port.direction == direction && (type.empty() || port.type == type)) names.push_back(port.name);
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace nido
