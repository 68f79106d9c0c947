#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "client_connection.h"
#include "nido/middleware/typed_port.h"
#include "nido/wrappers/clients.h"
#include "nido/wrappers/servers.h"
#include "stamps.h"

namespace nido {
namespace {

class TouchServer final : public IServer {
 public:
  TouchServer(std::string stem, ITouch& touch, const TouchServing& serving)
      : stem_(std::move(stem)), touch_(touch), due_(serving.period_ns), serving_(serving) {}

  Status open(Node& node) {
    auto output = node.open_output<msgs::Touch>(stem_ + ":o", Profile::kState);
    if (!output) return output.error();
    output_ = std::move(*output);
    return {};
  }

  Status publish(std::int64_t now_ns) override {
    if (!due_.at(now_ns)) return {};
    if (serving_.on_demand && output_->reader_count() == 0) return {};
    Result<TouchReading> reading = touch_.read_touch();
    if (!reading) return Error{reading.error().code, stem_ + ": " + reading.error().message};
    message_.header(header(reading->stamp_ns, serving_.frame_id));
    message_.on().assign(reading->on.begin(), reading->on.end());
    message_.force_n(std::move(reading->force_N));
    return output_->write(message_);
  }

 private:
  const std::string stem_;
  ITouch& touch_;
  Due due_;
  const TouchServing serving_;
  msgs::Touch message_;
  std::unique_ptr<Output<msgs::Touch>> output_;
};

class TouchClient final : public ITouch {
 public:
  TouchClient(ClientOptions options, int pads) : options_(std::move(options)), pads_(pads) {}

  Status open(Node& node) {
    auto input = open_connected<msgs::Touch>(node, options_, "", Profile::kState, 4);
    if (!input) return input.error();
    input_ = std::move(*input);
    return {};
  }

  int pads() const override { return pads_; }

  Result<TouchReading> read_touch() const override {
    const std::lock_guard lock(mutex_);
    if (std::optional<msgs::Touch> message = input_->take_latest()) {
      const std::size_t pads = message->on().size();
      const auto expected = static_cast<std::size_t>(pads_);
      if (pads != expected || message->force_n().size() != expected) {
        return Error{ErrorCode::kFailed, options_.remote + ":o: expected " + std::to_string(pads_) +
                                             " pads, got " + std::to_string(pads)};
      }
      TouchReading reading;
      reading.stamp_ns = to_ns(message->header().stamp());
      reading.on.assign(message->on().begin(), message->on().end());
      reading.force_N = std::move(message->force_n());
      newest_ = std::move(reading);
    }
    if (!newest_) return Error{ErrorCode::kTimeout, options_.remote + ":o: nothing has come yet"};
    return *newest_;
  }

 private:
  const ClientOptions options_;
  const int pads_;
  mutable std::mutex mutex_;
  std::unique_ptr<Input<msgs::Touch>> input_;
  mutable std::optional<TouchReading> newest_;
};

}  // namespace

Result<std::unique_ptr<IServer>> serve_touch(Node& node, const std::string& stem, ITouch& touch,
                                             const TouchServing& serving) {
  auto server = std::make_unique<TouchServer>(stem, touch, serving);
  if (Status opened = server->open(node); !opened) return opened.error();
  return std::unique_ptr<IServer>(std::move(server));
}

Result<std::unique_ptr<ITouch>> touch_client(Node& node, const ClientOptions& options, int pads) {
  auto client = std::make_unique<TouchClient>(options, pads);
  if (Status opened = client->open(node); !opened) return opened.error();
  return std::unique_ptr<ITouch>(std::move(client));
}

}  // namespace nido
