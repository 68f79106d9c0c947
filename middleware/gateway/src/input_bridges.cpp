#include <fmt/format.h>

#include <atomic>
#include <utility>

#include "bridges.h"
#include "nido/textproto/text_value.h"

namespace nido::gateway {
namespace {

constexpr double kConnect_s = 3.0;
constexpr double kService_s = 3.0;
constexpr std::size_t kImageBytes = 16 << 20;

// A control board's stream and its orders are worked on in the order of their coming: a stop that was sent
// after a command must not be done before it.
std::string worker_name(const std::string& port) {
  for (const std::string_view end : {"/rpc:i", "/command:i"}) {
    if (std::string_view(port).ends_with(end)) return port.substr(0, port.size() - end.size());
  }
  return port;
}

class InputBridge final : public Bridge {
 public:
  InputBridge(BridgeContext& context, const PortDescription& port, const AnyType& type, Profile profile)
      : context_(context), name_(port.name), type_(type), profile_(profile) {}

  ~InputBridge() override {
    context_.ports.close_port(name_);
    if (worker_) worker_->wait();
  }

  Status open() {
    yarp::PortSpec spec;
    spec.name = name_;
    spec.takes = true;
    spec.about = "takes messages of type " + type_.name;
    if (type_.name == "sensor_msgs/msg/Image") spec.limits.message = kImageBytes;
    spec.on_message = [this](yarp::Incoming incoming) {
      if (!worker_) worker_ = context_.workers.of(worker_name(name_));
      // a stream is read as it comes, so that an order that comes after it finds it in the worker's queue;
      // beyond that queue's bound its sender waits
      if (!incoming.wants_reply && waiting_ < kMostWaiting) {
        std::exchange(incoming.answer, [](std::optional<yarp::Bottle>) {})(std::nullopt);
      }
      ++waiting_;
      worker_->add([this, incoming = std::move(incoming)]() mutable {
        --waiting_;
        take(std::move(incoming));
      });
    };
    return context_.ports.open_port(std::move(spec));
  }

 private:
  void take(yarp::Incoming incoming) {
    const Status written = write(incoming);
    if (!written) warn(incoming.sender, written.error().message);
    incoming.answer(
        written ? yarp::Bottle{yarp::Value::word("ok")}
                : yarp::Bottle{yarp::Value::word("fail"), yarp::Value::string(written.error().message)});
  }

  Status write(const yarp::Incoming& incoming) {
    const std::shared_ptr<void> message = type_.type.make_message();
    if (Status taken = take_into(type_, incoming, context_.node.now().ns, message.get()); !taken)
      return taken;
    if (!output_) {
      auto output =
          context_.node.open_raw_output(own_name(context_.node, name_, ":o"), type_.type, profile_, kDepth);
      if (!output) return output.error();
      if (Status connected = context_.directory.connect((*output)->name(), name_, kConnect_s); !connected) {
        return connected;
      }
      if (!(*output)->wait_for_readers(1, kConnect_s)) {
        return Error{ErrorCode::kTimeout, name_ + " does not take from " + (*output)->name()};
      }
      output_ = std::move(*output);
    }
    return output_->write(message.get());
  }

  // a stream of bad messages makes one line a second
  void warn(const std::string& sender, const std::string& reason) {
    const auto now = std::chrono::steady_clock::now();
    if (now - warned_ < std::chrono::seconds(1)) return;
    warned_ = now;
    context_.node.log_warning(fmt::format("{}: a message of {} was refused: {}", name_, sender, reason));
  }

  static constexpr std::size_t kDepth = 256;
  static constexpr int kMostWaiting = 256;
  BridgeContext& context_;
  const std::string name_;
  const AnyType& type_;
  const Profile profile_;
  std::unique_ptr<RawOutput> output_;  // the worker's
  std::chrono::steady_clock::time_point warned_{};
  std::atomic<int> waiting_ = 0;  // messages in the worker's queue
  std::shared_ptr<Worker> worker_;
};

// An answer in YARP's notation as it is; a sentence for people as one string.
yarp::Bottle bottle_of_reply(const std::string& reply) {
  Result<yarp::Bottle> bottle = yarp::parse_bottle(reply);
  const bool is_notation = bottle && (bottle->empty() || bottle->front().kind != yarp::Value::Kind::kString ||
                                      yarp::to_text(*bottle) == reply);
  return is_notation ? std::move(*bottle) : yarp::Bottle{yarp::Value::string(reply)};
}

class ServiceBridge final : public Bridge {
 public:
  ServiceBridge(BridgeContext& context, std::string name) : context_(context), name_(std::move(name)) {}

  ~ServiceBridge() override {
    context_.ports.close_port(name_);
    if (worker_) worker_->wait();
  }

  Status open() {
    yarp::PortSpec spec;
    spec.name = name_;
    spec.takes = true;
    spec.about = "answers lines of text; 'help' tells which";
    spec.on_message = [this](yarp::Incoming incoming) {
      if (!worker_) worker_ = context_.workers.of(worker_name(name_));
      worker_->add([this, incoming = std::move(incoming)]() mutable { ask(std::move(incoming)); });
    };
    return context_.ports.open_port(std::move(spec));
  }

 private:
  void ask(yarp::Incoming incoming) {
    const auto refuse = [&](const std::string& reason) {
      incoming.answer(yarp::Bottle{yarp::Value::word("fail"), yarp::Value::string(reason)});
    };
    std::string line;
    if (incoming.is_text) {
      line = incoming.bytes;
    } else {
      const Result<yarp::Decoded> content = incoming.content();
      if (!content) return refuse(content.error().message);
      line = yarp::to_text(content->bottle);
    }
    const Result<std::string> reply = context_.node.call(name_, line, kService_s);
    if (!reply) return refuse(reply.error().message);
    incoming.answer(bottle_of_reply(*reply));
  }

  BridgeContext& context_;
  const std::string name_;
  std::shared_ptr<Worker> worker_;
};

}  // namespace

Result<std::unique_ptr<Bridge>> bridge_input(BridgeContext& context, const PortDescription& port) {
  const AnyType* type = find_any_type(port.type);
  if (type == nullptr) {
    return Error{ErrorCode::kUnsupported, fmt::format("{}: type {} is not known here", port.name, port.type)};
  }
  const Result<Profile> profile = profile_from_string(port.profile);
  if (!profile) return profile.error();
  auto bridge = std::make_unique<InputBridge>(context, port, *type, *profile);
  if (Status opened = bridge->open(); !opened) return opened.error();
  return std::unique_ptr<Bridge>(std::move(bridge));
}

Result<std::unique_ptr<Bridge>> bridge_service(BridgeContext& context, const std::string& name) {
  auto bridge = std::make_unique<ServiceBridge>(context, name);
  if (Status opened = bridge->open(); !opened) return opened.error();
  return std::unique_ptr<Bridge>(std::move(bridge));
}

}  // namespace nido::gateway
