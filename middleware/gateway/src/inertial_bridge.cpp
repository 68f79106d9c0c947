// Which sensors an inertial unit has, for YARP's clients of many sensors.
#include "bridges.h"

namespace nido::gateway {
namespace {

using yarp::Bottle;
using yarp::Value;

Bottle sensors() {
  Bottle kinds(kSensorKinds, Value::list());
  for (const auto& [kind, name] : {std::pair{kGyroscopes, "head_gyroscope"},
                                   {kAccelerometers, "head_accelerometer"},
                                   {kOrientations, "head_orientation"}}) {
    // name, frame, nothing more
    kinds[kind].items = {Value::list({Value::string(name), Value::string("imu"), Value::string("")})};
  }
  return kinds;
}

class InertialBridge final : public Bridge {
 public:
  InertialBridge(BridgeContext& context, std::string name) : context_(context), name_(std::move(name)) {}
  ~InertialBridge() override { context_.ports.close_port(name_); }

  Status open() {
    yarp::PortSpec spec;
    spec.name = name_;
    spec.takes = true;
    spec.about = "tells which sensors there are: getMetadata";
    spec.on_message = [](yarp::Incoming incoming) {
      const Result<yarp::Decoded> request = incoming.content();
      const bool understood =
          request && !request->bottle.empty() && request->bottle[0].is_word("getMetadata");
      incoming.answer(understood ? sensors()
                                 : Bottle{Value::word("fail"), Value::string("getMetadata is understood")});
    };
    return context_.ports.open_port(std::move(spec));
  }

 private:
  BridgeContext& context_;
  const std::string name_;
};

}  // namespace

Result<std::unique_ptr<Bridge>> bridge_inertial(BridgeContext& context, const PortDescription& port) {
  auto bridge = std::make_unique<InertialBridge>(context, many_inertials(port.name) + "/rpc:o");
  if (Status opened = bridge->open(); !opened) return opened.error();
  return std::unique_ptr<Bridge>(std::move(bridge));
}

}  // namespace nido::gateway
