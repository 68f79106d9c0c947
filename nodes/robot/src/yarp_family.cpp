#include <fmt/format.h>

#include "nido/yarp/devices.h"
#include "nido/yarp/secret_handshake.h"
#include "src/device_registry.h"

namespace nido {
namespace {

using Keys = std::vector<Field>;

// the network that all devices of the family share, made by the first of them
Result<std::shared_ptr<yarp::Network>> network_of(const YAML::Node& parameters, DeviceContext& context) {
  if (context.yarp_network) return context.yarp_network;
  yarp::NetworkOptions options;
  options.names_host = parameters["names_host"].as<std::string>();
  options.names_port = parameters["names_port"].as<int>();
  options.own_host = parameters["own_host"].as<std::string>();
  options.timeout_s = parameters["timeout_s"].as<double>();
  if (const auto file = parameters["secret_file"].as<std::string>(); !file.empty()) {
    Result<std::string> secret = yarp::read_secret((context.file.parent_path() / file).string());
    if (!secret) return secret.error();
    options.secret = std::move(*secret);
  }
  Result<std::shared_ptr<yarp::Network>> network = yarp::Network::open(std::move(options));
  if (network) context.yarp_network = *network;
  return network;
}

yarp::RemoteDevice remote_of(const YAML::Node& parameters, const DeviceContext& context) {
  yarp::RemoteDevice device;
  device.remote = parameters["remote"].as<std::string>();
  device.local = device.remote;
  const IClock* clock = &context.clock;
  device.now_ns = [clock] { return clock->now_ns(); };
  return device;
}

// what every device of the family has, before its own
Keys keys(Keys own) {
  Keys all = {{.key = "remote", .required = true, .meaning = "stem of the far side's ports: /icub/left_arm"},
              {.key = "names_host", .fallback = "127.0.0.1", .meaning = "where the name server runs"},
              {.key = "names_port",
               .kind = ValueKind::kInteger,
               .fallback = "10000",
               .meaning = "its port",
               .min = 1,
               .max = 65535},
              {.key = "own_host", .fallback = "127.0.0.1", .meaning = "this computer, as the robot sees it"},
              {.key = "secret_file",
               .fallback = "''",
               .meaning = "the robot's auth.conf, seen from the robot file's folder"},
              {.key = "timeout_s",
               .kind = ValueKind::kNumber,
               .fallback = "5",
               .meaning = "time for the far side to answer, s",
               .min = 0.1,
               .max = 60}};
  all.insert(all.end(), own.begin(), own.end());
  return all;
}

template <class Device>
Result<MadeDevice> made(Result<std::unique_ptr<Device>> device) {
  if (!device) return device.error();
  return MadeDevice{std::move(*device)};
}

// a kind whose device is made of network, far side and parameters
template <class Make>
DeviceKind kind(const std::string& name, Keys own, Make make) {
  return {name,
          {"device " + name, "", keys(std::move(own))},
          [make](const YAML::Node& parameters, DeviceContext& context) -> Result<MadeDevice> {
            const Result<std::shared_ptr<yarp::Network>> network = network_of(parameters, context);
            if (!network) return network.error();
            return made(make(*network, remote_of(parameters, context), parameters));
          }};
}

}  // namespace

std::vector<DeviceKind> yarp_family() {
  using Network = std::shared_ptr<yarp::Network>;
  using Remote = yarp::RemoteDevice;
  const auto number = [](const char* key, const char* fallback, const char* meaning, double min, double max) {
    return Field{.key = key,
                 .kind = ValueKind::kNumber,
                 .fallback = fallback,
                 .meaning = meaning,
                 .min = min,
                 .max = max};
  };
  const auto whole = [](const char* key, const char* fallback, const char* meaning, double min, double max) {
    return Field{.key = key,
                 .kind = ValueKind::kInteger,
                 .fallback = fallback,
                 .meaning = meaning,
                 .min = min,
                 .max = max};
  };
  return {
      kind("yarp/control_board",
           {number("max_torque_Nm", "5", "of joints whose board does not tell it, N m", 0.01, 1000)},
           [](const Network& network, const Remote& remote, const YAML::Node& parameters) {
             return yarp::yarp_control_board(network, remote, parameters["max_torque_Nm"].as<double>());
           }),
      kind("yarp/camera",
           {whole("width", "320", "of a camera that does not tell of its lens, pixels", 1, 4096),
            whole("height", "240", "pixels", 1, 4096),
            number("focal_px", "257.34", "focal length, pixels", 1, 10000)},
           [](const Network& network, const Remote& remote, const YAML::Node& parameters) {
             const int width = parameters["width"].as<int>();
             const int height = parameters["height"].as<int>();
             const double focal_px = parameters["focal_px"].as<double>();
             return yarp::yarp_camera(network, remote,
                                      {width, height, focal_px, focal_px, width / 2.0, height / 2.0, {}});
           }),
      kind("yarp/touch",
           {number("threshold", "20", "above which a taxel (0..255) is touched", 0, 254),
            number("full_scale_N", "1", "force of a taxel at 255, N", 0.001, 1000),
            whole("taxels", "0", "of a patch of skin, a pad each; 0: a hand and its six pads", 0, 12000)},
           [](const Network& network, const Remote& remote, const YAML::Node& parameters) {
             return yarp::yarp_touch(
                 network, remote,
                 {parameters["threshold"].as<double>(), parameters["full_scale_N"].as<double>(),
                  parameters["taxels"].as<int>()});
           }),
      kind("yarp/force_torque", {},
           [](const Network& network, const Remote& remote, const YAML::Node&) {
             return yarp::yarp_force_torque(network, remote);
           }),
      kind("yarp/inertial", {},
           [](const Network& network, const Remote& remote, const YAML::Node&) {
             return yarp::yarp_inertial(network, remote);
           }),
      kind("yarp/audio",
           {whole("sample_rate_hz", "16000", "samples a second", 1000, 384000),
            whole("channels", "1", "microphones", 1, 64)},
           [](const Network& network, const Remote& remote, const YAML::Node& parameters) {
             return yarp::yarp_audio(network, remote, parameters["sample_rate_hz"].as<int>(),
                                     parameters["channels"].as<int>());
           }),
      kind("yarp/world", {},
           [](const Network& network, const Remote& remote, const YAML::Node&) {
             return yarp::yarp_world(network, remote);
           }),
  };
}

}  // namespace nido
