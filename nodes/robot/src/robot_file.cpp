#include "src/robot_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "nido/launcher/schema.h"
#include "src/device_registry.h"

namespace nido {
namespace {

std::vector<std::string> kind_names() {
  std::vector<std::string> names;
  for (const DeviceKind& kind : device_kinds()) names.push_back(kind.name);
  return names;
}

const Schema& device_schema() {
  static const Schema schema{
      "device",
      "name",
      {{.key = "name", .required = true, .meaning = "name of the device in this file"},
       {.key = "kind", .required = true, .meaning = "what it is", .allowed = kind_names()},
       {.key = "parameters",
        .kind = ValueKind::kAnyMap,
        .fallback = "{}",
        .meaning = "what this kind of device needs to know"}}};
  return schema;
}

const Schema& server_schema() {
  static const Schema schema{
      "server",
      "",
      {{.key = "device", .required = true, .meaning = "name of the device that is served"},
       {.key = "port", .required = true, .meaning = "stem of the port names, after the robot's name"},
       {.key = "rate_hz",
        .kind = ValueKind::kNumber,
        .fallback = "100",
        .meaning = "of the published messages",
        .min = 0.1,
        .max = 1000},
       {.key = "frame", .fallback = "''", .meaning = "frame_id of the messages"},
       {.key = "latency_s",
        .kind = ValueKind::kNumber,
        .fallback = "0",
        .meaning = "from taking a picture to its publication, below the period (cameras)",
        .min = 0,
        .max = 1},
       {.key = "on_demand",
        .kind = ValueKind::kFlag,
        .fallback = "false",
        .meaning = "only while somebody is connected (cameras, skin)"}}};
  return schema;
}

const Schema& body_schema() {
  static const Schema schema{
      "body",
      "",
      {{.key = "urdf", .required = true, .meaning = "the body, seen from this file's folder"},
       {.key = "rate_hz",
        .kind = ValueKind::kNumber,
        .fallback = "10",
        .meaning = "of /tf",
        .min = 0.1,
        .max = 100}}};
  return schema;
}

const Schema& robot_schema() {
  static const Schema schema{"robot file",
                             "",
                             {{.key = "robot", .required = true, .meaning = "first part of all port names"},
                              {.key = "clock",
                               .fallback = "wall",
                               .meaning = "whose time it is: simulated (/clock) or the computer's",
                               .allowed = {"simulated", "wall"}},
                              {.key = "period_s",
                               .kind = ValueKind::kNumber,
                               .fallback = "0.01",
                               .meaning = "control period, s",
                               .min = 0.001,
                               .max = 0.1},
                              {.key = "simulation",
                               .kind = ValueKind::kAnyMap,
                               .fallback = "{}",
                               .meaning = "parameters of the simulator"},
                              {.key = "body",
                               .kind = ValueKind::kMap,
                               .meaning = "poses of all links on /tf; without it there is no /tf",
                               .inner = &body_schema()},
                              {.key = "safety",
                               .kind = ValueKind::kMap,
                               .fallback = "{}",
                               .meaning = "what is held above all commands",
                               .inner = &safety_schema()},
                              {.key = "devices",
                               .kind = ValueKind::kList,
                               .required = true,
                               .meaning = "what the robot is made of",
                               .inner = &device_schema()},
                              {.key = "servers",
                               .kind = ValueKind::kList,
                               .required = true,
                               .meaning = "what is put on the network",
                               .inner = &server_schema()}}};
  return schema;
}

// a map of the file itself, which still knows its line
YAML::Node own_map(const YAML::Node& map, const char* key) {
  const YAML::Node found = map[key];
  return found && found.IsMap() ? found : YAML::Node(YAML::NodeType::Map);
}

}  // namespace

Result<RobotFile> load_robot_file(const std::filesystem::path& path) {
  const Result<YAML::Node> document = read_yaml(path.string());
  if (!document) return document.error();
  const Result<YAML::Node> checked = check_document(*document, robot_schema(), path.string());
  if (!checked) return checked.error();
  RobotFile file;
  file.path = path;
  file.robot = (*checked)["robot"].as<std::string>();
  file.simulated_time = (*checked)["clock"].as<std::string>() == "simulated";
  file.period_s = (*checked)["period_s"].as<double>();
  file.simulation = own_map(*document, "simulation");
  // its other keys are for the simulator, which checks this one too
  if (const YAML::Node window = file.simulation["window"]; window && window.IsScalar())
    YAML::convert<bool>::decode(window, file.window);
  if (const YAML::Node body = (*checked)["body"]) {
    file.body = {body["urdf"].as<std::string>(), body["rate_hz"].as<double>()};
  }
  Result<SafetyEntry> safety = read_safety((*checked)["safety"], path.string());
  if (!safety) return safety.error();
  file.safety = std::move(*safety);
  std::set<std::string> names;
  for (std::size_t i = 0; i < (*checked)["devices"].size(); ++i) {
    const YAML::Node entry = (*checked)["devices"][i];
    file.devices.push_back({entry["name"].as<std::string>(), entry["kind"].as<std::string>(),
                            own_map((*document)["devices"][i], "parameters")});
    names.insert(file.devices.back().name);
  }
  for (const auto& [device, narrowing] : file.safety.limits) {
    if (names.count(device) > 0) continue;
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}: safety.limits: there is no device '{}': there are {}", path.string(),
                             device, fmt::join(names, ", "))};
  }
  for (std::size_t i = 0; i < (*checked)["servers"].size(); ++i) {
    const YAML::Node entry = (*checked)["servers"][i];
    ServerEntry server{entry["device"].as<std::string>(), entry["port"].as<std::string>(),
                       entry["rate_hz"].as<double>(),     entry["frame"].as<std::string>(),
                       entry["latency_s"].as<double>(),   entry["on_demand"].as<bool>()};
    if (names.count(server.device) == 0) {
      return Error{
          ErrorCode::kInvalidArgument,
          fmt::format("{}:{}: there is no device '{}' to serve: there are {}", path.string(),
                      (*document)["servers"][i].Mark().line + 1, server.device, fmt::join(names, ", "))};
    }
    if (server.port.empty() || server.port.front() != '/') server.port = "/" + file.robot + "/" + server.port;
    file.servers.push_back(std::move(server));
  }
  return file;
}

}  // namespace nido
