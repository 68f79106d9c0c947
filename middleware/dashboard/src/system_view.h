#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nido/middleware/directory.h"

namespace nido {

// Processes and ports of a system with what changes between two looks: rates, CPU time. For one thread.
class SystemView {
 public:
  // `own_name`: the node that looks; its own ports and connections are no part of the system.
  explicit SystemView(std::string own_name) : own_name_(std::move(own_name)) {}

  void look(const std::vector<NodeDescription>& nodes);
  // [{name, pid, state, detail, restarts, cpu (1: one core), memory_mb}], also of those that have gone (state
  // "gone").
  [[nodiscard]] nlohmann::json nodes() const;
  // [{name, direction, type, node, profile, hz, bytes_s, readers or connections: [{from, live, lost}]}]
  [[nodiscard]] nlohmann::json ports() const;
  // Names of outputs of a type, of all nodes.
  [[nodiscard]] std::vector<std::string> ports_of(const std::string& direction,
                                                  const std::string& type = "") const;

 private:
  using SteadyClock = std::chrono::steady_clock;
  struct Process {
    NodeDescription node;
    bool gone = false;
    double cpu = 0;  // cores
    double memory_mb = 0;
    std::uint64_t cpu_ticks = 0;
    SteadyClock::time_point measured;
  };
  // A counter that a node announces about once a second, and its change.
  struct Rate {
    std::uint64_t count = 0;
    SteadyClock::time_point since;
    double per_s = 0;
    bool known = false;
    void update(std::uint64_t now_count, SteadyClock::time_point now);
  };
  void measure(Process& process);

  std::string own_name_;
  std::map<std::string, Process> processes_;
  std::map<std::string, Rate> messages_;  // by port
  std::map<std::string, Rate> bytes_;     // by "OUTPUT IN" connection
};

}  // namespace nido
