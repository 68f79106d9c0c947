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

constexpr int kPads = 6;

class TouchServer final : public IServer {
 public:
  TouchServer(std::string stem, ITouch& touch, std::int64_t period_ns, std::string frame_id)
      : stem_(std::move(stem)), touch_(touch), due_(period_ns), frame_id_(std::move(frame_id)) {}

  Status open(Node& node) {
    auto output = node.open_output<msgs::Touch>(stem_ + ":o", Profile::kState);
    if (!output) return output.error();
    output_ = std::move(*output);
    return {};
  }

  Status publish(std::int64_t now_ns) override {
    if (!due_.at(now_ns)) return {};
    Result<TouchReading> reading = touch_.read_touch();
    if (!reading) return Error{reading.error().code, stem_ + ": " + reading.error().message};
    message_.header(header(reading->stamp_ns, frame_id_));
    message_.on().assign(reading->on.begin(), reading->on.end());
    message_.force_n(std::move(reading->force_N));
    return output_->write(message_);
  }

 private:
  const std::string stem_;
  ITouch& touch_;
  Due due_;
  const std::string frame_id_;
  msgs::Touch message_;
  std::unique_ptr<Output<msgs::Touch>> output_;
};

class TouchClient final : public ITouch {
 public:
  explicit TouchClient(ClientOptions options) : options_(std::move(options)) {}

  Status open(Node& node) {
    auto input = open_connected<msgs::Touch>(node, options_, "", Profile::kState, 4);
    if (!input) return input.error();
    input_ = std::move(*input);
    return {};
  }

  int pads() const override { return kPads; }

  Result<TouchReading> read_touch() const override {
    const std::lock_guard lock(mutex_);
    if (std::optional<msgs::Touch> message = input_->take_latest()) {
      const std::size_t pads = message->on().size();
      if (pads != kPads || message->force_n().size() != kPads) {
        return Error{ErrorCode::kFailed,
                     options_.remote + ":o: expected 6 pads, got " + std::to_string(pads)};
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
  mutable std::mutex mutex_;
  std::unique_ptr<Input<msgs::Touch>> input_;
  mutable std::optional<TouchReading> newest_;
};

}  // namespace

Result<std::unique_ptr<IServer>> serve_touch(Node& node, const std::string& stem, ITouch& touch,
                                             std::int64_t period_ns, const std::string& frame_id) {
  auto server = std::make_unique<TouchServer>(stem, touch, period_ns, frame_id);
  if (Status opened = server->open(node); !opened) return opened.error();
  return std::unique_ptr<IServer>(std::move(server));
}

Result<std::unique_ptr<ITouch>> touch_client(Node& node, const ClientOptions& options) {
  auto client = std::make_unique<TouchClient>(options);
  if (Status opened = client->open(node); !opened) return opened.error();
  return std::unique_ptr<ITouch>(std::move(client));
}

}  // namespace nido
