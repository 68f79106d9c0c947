#include <fmt/format.h>

#include <cmath>
#include <mutex>
#include <numbers>

#include "bridges.h"
#include "nido/msgs/types.h"

namespace nido::gateway {
namespace {

using yarp::Bottle;
using yarp::Value;

constexpr double kWait_s = 2.0;  // for the first CameraInfo
constexpr double kRadian_deg = 180.0 / std::numbers::pi;

Bottle failed(const std::string& reason) { return {Value::word("fail"), Value::string(reason)}; }

// What a YARP frame grabber says about its pictures. Interfaces: fgi pictures, visr how the lens makes them.
Bottle answer_about(const msgs::CameraInfo& info, const Bottle& request) {
  const auto text = [&](std::size_t at) {
    return at < request.size() && request[at].is_text() ? request[at].text : std::string();
  };
  const std::string interface = text(0);
  const std::string what = text(2);
  if (interface != "fgi" && interface != "visr") {
    return failed(fmt::format("'{}' is not known: [fgi] and [visr] are; exposure and the like cannot be set",
                              interface.substr(0, 20)));
  }
  if (text(1) != "get") return failed("this camera is set by its robot file");
  Bottle reply = {Value::word(interface), Value::word(what), Value::word("is")};
  const auto number = [&](double value) { reply.push_back(Value::of(value)); };
  const auto whole = [&](std::uint32_t value) {
    reply.push_back(Value::of(static_cast<std::int64_t>(value)));
  };
  const double fx_px = info.k()[0];
  const double fy_px = info.k()[4];
  if (what == "w") {
    whole(info.width());
  } else if (what == "h") {
    whole(info.height());
  } else if (interface == "visr" && what == "res") {
    whole(info.width());
    whole(info.height());
  } else if (interface == "visr" && what == "fov") {
    number(2 * std::atan2(info.width() / 2.0, fx_px) * kRadian_deg);
    number(2 * std::atan2(info.height() / 2.0, fy_px) * kRadian_deg);
  } else if (interface == "visr" && what == "mirr") {
    whole(0);
  } else if (interface == "visr" && what == "intp") {
    Bottle pairs;
    const auto pair = [&](const char* key, Value value) {
      pairs.push_back(Value::list({Value::string(key), std::move(value)}));
    };
    pair("physFocalLength", Value::of(0.0));
    pair("focalLengthX", Value::of(fx_px));
    pair("focalLengthY", Value::of(fy_px));
    // centre of the first pixel at (0, 0) there, at (0.5, 0.5) here
    pair("principalPointX", Value::of(info.k()[2] - 0.5));
    pair("principalPointY", Value::of(info.k()[5] - 0.5));
    const bool is_distorted = info.d().size() == 5;
    pair("distortionModel", Value::string(is_distorted ? "plumb_bob" : "none"));
    constexpr const char* kNames[] = {"k1", "k2", "t1", "t2", "k3"};
    for (std::size_t i = 0; is_distorted && i < 5; ++i) pair(kNames[i], Value::of(info.d()[i]));
    reply.push_back(Value::list(std::move(pairs)));
  } else {
    return failed(fmt::format("'{}' cannot be got: w, h, res, fov, mirr and intp can", what.substr(0, 20)));
  }
  return reply;
}

class CameraBridge final : public Bridge {
 public:
  CameraBridge(BridgeContext& context, std::string info_port, const AnyType& type, std::string name)
      : context_(context), info_port_(std::move(info_port)), type_(type), name_(std::move(name)) {}

  ~CameraBridge() override {
    context_.ports.close_port(name_);
    worker_.reset();
  }

  Status open() {
    yarp::PortSpec spec;
    spec.name = name_;
    spec.takes = true;
    spec.about = "answers about its pictures: [visr] [get] [w|h|res|fov|intp]";
    spec.on_message = [this](yarp::Incoming incoming) {
      if (!worker_) worker_ = std::make_unique<Worker>();
      worker_->add([this, incoming = std::move(incoming)] { incoming.answer(reply(incoming)); });
    };
    return context_.ports.open_port(std::move(spec));
  }

 private:
  Bottle reply(const yarp::Incoming& incoming) {
    const Result<yarp::Decoded> request = incoming.content();
    if (!request) return failed(request.error().message);
    if (!input_) {
      auto input = context_.node.open_raw_input(own_name(context_.node, info_port_, "_rpc:i"), type_.type,
                                                Profile::kState, 2);
      if (!input) return failed(input.error().message);
      input_ = std::move(*input);
      if (const Status connected = input_->connect(info_port_); !connected)
        return failed(connected.error().message);
    }
    if (!newest_) input_->wait_for_message(kWait_s);
    if (std::optional<RawReceived> received = input_->take_latest()) newest_ = std::move(received->message);
    if (!newest_) return failed("nothing has come from " + info_port_ + " yet");
    return answer_about(*static_cast<const msgs::CameraInfo*>(newest_.get()), request->bottle);
  }

  BridgeContext& context_;
  const std::string info_port_;
  const AnyType& type_;
  const std::string name_;
  std::unique_ptr<RawInput> input_;  // the worker's, as is the next
  std::shared_ptr<void> newest_;
  std::unique_ptr<Worker> worker_;
};

}  // namespace

Result<std::unique_ptr<Bridge>> bridge_camera(BridgeContext& context, const PortDescription& port) {
  constexpr std::string_view kEnd = "/camera_info:o";
  const AnyType* type = find_any_type(port.type);
  if (type == nullptr || !std::string_view(port.name).ends_with(kEnd)) {
    return Error{ErrorCode::kUnsupported, port.name + " tells of no camera"};
  }
  auto bridge = std::make_unique<CameraBridge>(context, port.name, *type,
                                               port.name.substr(0, port.name.size() - kEnd.size()) + "/rpc");
  if (Status opened = bridge->open(); !opened) return opened.error();
  return std::unique_ptr<Bridge>(std::move(bridge));
}

}  // namespace nido::gateway
