#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "verbs.h"

namespace nido::cli {
namespace {

constexpr std::string_view kRestarts = "restarts = ";

// How often its launcher has started this process again; 0 if it was started by hand.
int take_restarts(NodeDescription& node) {
  const auto found = std::find_if(node.parameters.begin(), node.parameters.end(),
                                  [](const std::string& text) { return text.starts_with(kRestarts); });
  if (found == node.parameters.end()) return 0;
  const int count = std::atoi(found->c_str() + kRestarts.size());
  node.parameters.erase(found);
  return count;
}

Json json_of(const NodeDescription& node, int restarts) {
  Json ports = Json::array();
  for (const auto& port : node.ports) {
    Json connections = Json::array();
    for (const auto& counters : port.connections) {
      connections.push_back({{"source", counters.source},
                             {"live", counters.live},
                             {"received", counters.received},
                             {"lost", counters.lost}});
    }
    ports.push_back({{"name", port.name},
                     {"direction", port.direction},
                     {"type", port.type},
                     {"profile", port.profile},
                     {"written", port.written},
                     {"connections", connections}});
  }
  return {{"name", node.name},
          {"pid", node.pid},
          {"host", node.host},
          {"state", node.state},
          {"detail", node.detail},
          {"restarts", restarts},
          {"parameters", node.parameters},
          {"ports", ports}};
}

// The node's service that is called by the first word: "/icubSim/estop" for "estop clear".
std::string service_named(const NodeDescription& node, const std::string& word) {
  for (const auto& port : node.ports) {
    if (port.direction == "service" && port.name.substr(port.name.rfind('/') + 1) == word) return port.name;
  }
  return "";
}

}  // namespace

int node_list(const Common& common) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  settle(*session->directory);
  if (interrupted()) return 130;
  auto nodes = session->directory->nodes();
  std::sort(nodes.begin(), nodes.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  if (common.json) {
    Json list = Json::array();
    for (const auto& node : nodes)
      list.push_back({{"name", node.name},
                      {"pid", node.pid},
                      {"host", node.host},
                      {"state", node.state},
                      {"detail", node.detail}});
    fmt::print("{}\n", list.dump(2));
    return 0;
  }
  if (nodes.empty()) fmt::print(stderr, "no nodes in domain {}\n", common.domain);
  for (const auto& node : nodes) {
    fmt::print("{:<18} {:<9} pid {:<8} {}{}\n", node.name, node.state, node.pid, node.host,
               node.detail.empty() ? "" : "  " + node.detail);
  }
  return 0;
}

int node_info(const Common& common, const std::string& name) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  auto node = find_node(*session, common, name);
  if (interrupted()) return 130;
  if (!node) return fail(common, node.error());
  const int restarts = take_restarts(*node);
  if (common.json) {
    fmt::print("{}\n", json_of(*node, restarts).dump(2));
    return 0;
  }
  fmt::print("{}: {}, pid {} on {}, {} restarts{}\n", node->name, node->state, node->pid, node->host,
             restarts, node->detail.empty() ? "" : "; " + node->detail);
  if (!node->parameters.empty()) fmt::print("parameters\n");
  for (const auto& parameter : node->parameters) fmt::print("  {}\n", parameter);
  for (const auto& [direction, title] : {std::pair<std::string, std::string>{"input", "reads"},
                                         {"output", "writes"},
                                         {"service", "answers"}}) {
    bool first = true;
    for (const auto& port : node->ports) {
      if (port.direction != direction) continue;
      if (first) fmt::print("{}\n", title);
      first = false;
      fmt::print("  {:<34} {}{}\n", port.name, port.type, port.profile.empty() ? "" : ", " + port.profile);
      if (direction == "output") {
        if (port.written > 0) fmt::print("      written {}\n", port.written);
        continue;
      }
      for (const auto& counters : port.connections) {
        fmt::print("      from {}: received {}, lost {}{}\n", counters.source, counters.received,
                   counters.lost, counters.live ? "" : "; not there now");
      }
    }
  }
  return 0;
}

int node_call(const Common& common, const std::string& name, const std::vector<std::string>& words) {
  auto session = join(common);
  if (!session) return fail(common, session.error());
  auto node = find_node(*session, common, name);
  if (interrupted()) return 130;
  if (!node) return fail(common, node.error());
  std::string port = service_named(*node, words.front());
  // what is no service of the node is a word for the node itself
  const std::size_t first = port.empty() ? 0 : 1;
  if (port.empty()) port = "/" + name + "/control";
  std::string text;
  for (std::size_t i = first; i < words.size(); ++i) text += (i > first ? " " : "") + words[i];
  auto answer = session->node->call(port, text, common.wait_s);
  if (interrupted()) return 130;
  if (!answer) return fail(common, answer.error());
  fmt::print("{}\n",
             common.json ? Json{{"port", port}, {"request", text}, {"answer", *answer}}.dump() : *answer);
  return answer->starts_with("[fail]") ? 1 : 0;
}

}  // namespace nido::cli
