#include "nido/gateway/gateway.h"

#include <fmt/format.h>

#include <map>
#include <set>

#include "bridges.h"
#include "nido/yarp/secret_handshake.h"

namespace nido::gateway {
namespace {

constexpr double kLook_s = 0.25;  // how often ports that came and went are looked for

class GatewayImpl final : public Gateway {
 public:
  GatewayImpl(Node& node, yarp::EventLoop& loop) : node_(node), loop_(loop) {}
  ~GatewayImpl() override { *alive_ = nullptr; }

  Status open(GatewayOptions options) {
    options.ports.log = [this](const std::string& sentence) { node_.log_info(sentence); };
    auto directory = Directory::open(node_);
    if (!directory) return directory.error();
    directory_ = std::move(*directory);
    auto ports = yarp::PortHost::open(loop_, options.ports);
    if (!ports && ports.error().code == ErrorCode::kTaken && options.register_if_taken) {
      options.ports.names = yarp::PortHostOptions::Names::kRegister;
      ports = yarp::PortHost::open(loop_, options.ports);
    }
    if (!ports) return ports.error();
    ports_ = std::move(*ports);
    node_.log_info(fmt::format(
        "names are {} {}:{}",
        options.ports.names == yarp::PortHostOptions::Names::kServe ? "served on" : "registered at",
        options.ports.host, options.ports.names_port));
    stems_ = {options.gaze_stem, options.cartesian_stem};
    context_.emplace(BridgeContext{node_, *directory_, loop_, *ports_, workers_});
    loop_.every(kLook_s, [alive = alive_] {
      if (*alive != nullptr) (*alive)->look();
    });
    look();
    return {};
  }

  yarp::PortHost& ports() override { return *ports_; }

 private:
  void look() {
    std::map<std::string, PortDescription> there;
    for (const NodeDescription& node : directory_->nodes()) {
      if (node.name == node_.options().name || node.state == "stopping") continue;
      for (const PortDescription& port : node.ports) there[port.name] = port;
    }
    for (auto bridge = bridges_.begin(); bridge != bridges_.end();) {
      bridge = there.contains(bridge->first) ? std::next(bridge) : bridges_.erase(bridge);
    }
    for (const auto& [name, port] : there) {
      if (bridges_.contains(name) || hopeless_.contains(name)) continue;
      Result<std::unique_ptr<Bridge>> bridge = port.direction == "output"  ? bridge_output(*context_, port)
                                               : port.direction == "input" ? bridge_input(*context_, port)
                                                                           : bridge_service(*context_, name);
      if (!bridge) {
        node_.log_warning(fmt::format("{} is not shown to YARP: {}", name, bridge.error().message));
        hopeless_.insert(name);
        continue;
      }
      bridges_[name].push_back(std::move(*bridge));
      // what YARP's programs expect besides, where it applies
      const auto add = [&](Result<std::unique_ptr<Bridge>> more) {
        if (!more) node_.log_warning(fmt::format("{}: {}", name, more.error().message));
        if (more && *more) bridges_[name].push_back(std::move(*more));
      };
      if (port.direction == "service") add(bridge_task(*context_, name, stems_));
      if (port.direction != "output") continue;
      if (port.type == "sensor_msgs/msg/Imu" && name.ends_with(kInertialOutput))
        add(bridge_inertial(*context_, port));
      if (port.type == "sensor_msgs/msg/CameraInfo") add(bridge_camera(*context_, port));
    }
  }

  Node& node_;
  yarp::EventLoop& loop_;
  std::shared_ptr<GatewayImpl*> alive_ = std::make_shared<GatewayImpl*>(this);
  std::unique_ptr<Directory> directory_;
  std::unique_ptr<yarp::PortHost> ports_;
  Workers workers_;
  TaskStems stems_;
  std::optional<BridgeContext> context_;
  std::map<std::string, std::vector<std::unique_ptr<Bridge>>> bridges_;  // by nido's port
  std::set<std::string> hopeless_;
};

// "none", or nothing at all, which YAML calls null: no such ports.
Result<std::string> stem_parameter(Node& node, const char* key, const std::string& fallback) {
  const auto given = node.parameter<std::string>(key, fallback);
  if (!given) return given.error();
  return *given == "none" || *given == "null" ? std::string() : std::string(*given);
}

}  // namespace

Result<std::unique_ptr<Gateway>> Gateway::open(Node& node, yarp::EventLoop& loop, GatewayOptions options) {
  auto gateway = std::make_unique<GatewayImpl>(node, loop);
  if (Status opened = gateway->open(std::move(options)); !opened) return opened.error();
  return std::unique_ptr<Gateway>(std::move(gateway));
}

Result<GatewayOptions> gateway_options(Node& node) {
  GatewayOptions options;
  const auto host = node.parameter<std::string>("host", options.ports.host);
  const auto names_port = node.parameter<int>("names_port", options.ports.names_port);
  const auto names = node.parameter<std::string>("names", "auto");
  const auto secret_file = node.parameter<std::string>("secret_file", "");
  const Result<std::string> gaze_stem = stem_parameter(node, "gaze_stem", options.gaze_stem);
  const Result<std::string> cartesian_stem = stem_parameter(node, "cartesian_stem", options.cartesian_stem);
  const auto first_port = node.parameter<int>("first_port", 0);
  const auto dialect = node.parameter<int>("dialect", 3);
  const auto connections = node.parameter<int>("connections", static_cast<int>(options.ports.connections));
  for (const auto* number : {&names_port, &first_port, &dialect, &connections}) {
    if (!*number) return number->error();
  }
  for (const auto* word : {&host, &names, &secret_file}) {
    if (!*word) return word->error();
  }
  for (const auto* stem : {&gaze_stem, &cartesian_stem}) {
    if (!*stem) return stem->error();
  }
  const auto wrong = [](std::string what) { return Error{ErrorCode::kInvalidArgument, std::move(what)}; };
  if (*names_port < 1 || *names_port > 65'535)
    return wrong(fmt::format("names_port is {}: 1..65535", *names_port));
  if (*first_port < 0 || *first_port > 65'000)
    return wrong(fmt::format("first_port is {}: 0..65000", *first_port));
  if (*dialect != 3 && *dialect != 4) return wrong(fmt::format("dialect is {}: 3 or 4", *dialect));
  if (*connections < 1) return wrong(fmt::format("connections is {}: 1 or more", *connections));
  if (*names != "auto" && *names != "serve" && *names != "register") {
    return wrong(fmt::format("names is '{}': auto, serve or register", *names));
  }
  if (!secret_file->empty()) {
    Result<std::string> secret = yarp::read_secret(*secret_file);
    if (!secret) return secret.error();
    options.ports.secret = std::move(*secret);
  }
  if (!gaze_stem->empty() &&
      (gaze_stem->front() != '/' || gaze_stem->size() < 2 || gaze_stem->ends_with('/'))) {
    return wrong(fmt::format("gaze_stem is '{}': the beginning of port names, as /iKinGazeCtrl, or nothing",
                             *gaze_stem));
  }
  if (cartesian_stem->starts_with('/') || cartesian_stem->ends_with('/')) {
    return wrong(fmt::format(
        "cartesian_stem is '{}': a part of port names, as cartesianController, or nothing", *cartesian_stem));
  }
  options.gaze_stem = *gaze_stem;
  options.cartesian_stem = *cartesian_stem;
  options.ports.host = *host;
  options.ports.names_port = *names_port;
  options.ports.first_port = *first_port;
  options.ports.connections = static_cast<std::size_t>(*connections);
  options.ports.dialect = *dialect == 3 ? yarp::Dialect::k3 : yarp::Dialect::k4;
  options.register_if_taken = *names == "auto" && options.ports.secret.empty();
  options.ports.names =
      *names == "register" ? yarp::PortHostOptions::Names::kRegister : yarp::PortHostOptions::Names::kServe;
  return options;
}

}  // namespace nido::gateway
