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

msgs::CameraInfo to_message(const CameraInfo& info) {
  msgs::CameraInfo message;
  message.width(static_cast<std::uint32_t>(info.width));
  message.height(static_cast<std::uint32_t>(info.height));
  message.distortion_model("plumb_bob");
  message.d(info.distortion);
  message.d().resize(5, 0.0);
  message.k({info.fx_px, 0, info.cx_px, 0, info.fy_px, info.cy_px, 0, 0, 1});
  message.r({1, 0, 0, 0, 1, 0, 0, 0, 1});
  message.p({info.fx_px, 0, info.cx_px, 0, 0, info.fy_px, info.cy_px, 0, 0, 0, 1, 0});
  return message;
}

class CameraServer final : public IServer {
 public:
  CameraServer(Node& node, std::string stem, ICamera& camera, CameraServing serving)
      : node_(node),
        stem_(std::move(stem)),
        camera_(camera),
        shutter_(serving.latency_ns > 0 ? dynamic_cast<IShutter*>(&camera) : nullptr),
        serving_(std::move(serving)),
        due_(serving_.period_ns),
        has_delivered_(!serving_.first_at_once) {}

  Status open() {
    auto image = node_.open_output<msgs::Image>(stem_ + "/image:o", Profile::kSensor);
    if (!image) return image.error();
    image_ = std::move(*image);
    auto info = node_.open_output<msgs::CameraInfo>(stem_ + "/camera_info:o", Profile::kState);
    if (!info) return info.error();
    info_ = std::move(*info);
    return {};
  }

  Status publish(std::int64_t now_ns) override {
    if (is_taken_ && now_ns - taken_ns_ >= serving_.latency_ns) {
      is_taken_ = false;
      if (Status delivered = deliver(); !delivered) return delivered;
    }
    if (!due_.at(now_ns)) return {};
    if (serving_.on_demand && image_->reader_count() == 0 && info_->reader_count() == 0) return {};
    if (shutter_ == nullptr || !has_delivered_) return deliver();
    if (is_taken_) return {};  // the latency is longer than the period: this picture is left out
    if (Status opened = shutter_->open_shutter(); !opened) return failed(opened);
    is_taken_ = true;
    taken_ns_ = now_ns;
    return {};
  }

 private:
  Status deliver() {
    const Result<CameraInfo> info = camera_.info();
    if (!info) return failed(info);
    // the picture is taken into the message's own storage
    taken_.rgb = std::move(message_.data());
    const Status grabbed = camera_.grab(taken_);
    message_.data(std::move(taken_.rgb));
    if (!grabbed) return failed(grabbed);
    // a picture is told once: both eyes' pictures of one moment then come together, in whatever order
    if (has_delivered_ && shutter_ == nullptr && taken_.stamp_ns == delivered_ns_) return {};
    delivered_ns_ = taken_.stamp_ns;
    has_delivered_ = true;
    message_.header(header(taken_.stamp_ns, serving_.frame_id));
    message_.width(static_cast<std::uint32_t>(taken_.width));
    message_.height(static_cast<std::uint32_t>(taken_.height));
    message_.encoding("rgb8");
    message_.is_bigendian(0);
    message_.step(static_cast<std::uint32_t>(taken_.width) * 3);
    if (Status written = image_->write(message_); !written) return written;
    msgs::CameraInfo info_message = to_message(*info);
    info_message.header(message_.header());
    return info_->write(info_message);
  }

  template <class Outcome>
  [[nodiscard]] Error failed(const Outcome& outcome) const {
    return Error{outcome.error().code, stem_ + ": " + outcome.error().message};
  }

  Node& node_;
  const std::string stem_;
  ICamera& camera_;
  IShutter* const shutter_;  // null: pictures are published when they are taken
  const CameraServing serving_;
  Due due_;
  bool is_taken_ = false;  // a picture waits for its publication
  std::int64_t taken_ns_ = 0;
  bool has_delivered_ = false;
  std::int64_t delivered_ns_ = 0;  // stamp of the last picture
  Image taken_;
  msgs::Image message_;
  std::unique_ptr<Output<msgs::Image>> image_;
  std::unique_ptr<Output<msgs::CameraInfo>> info_;
};

class CameraClient final : public ICamera {
 public:
  CameraClient(Node& node, ClientOptions options) : node_(node), options_(std::move(options)) {}

  Status open() {
    auto image = open_connected<msgs::Image>(node_, options_, "/image", Profile::kSensor, 2);
    if (!image) return image.error();
    image_ = std::move(*image);
    auto info = open_connected<msgs::CameraInfo>(node_, options_, "/camera_info", Profile::kState, 2);
    if (!info) return info.error();
    info_ = std::move(*info);
    return {};
  }

  Status grab(Image& image) override {
    const std::lock_guard lock(mutex_);
    if (std::optional<msgs::Image> message = image_->take_latest()) {
      const std::size_t width = message->width();
      const std::size_t height = message->height();
      if (message->encoding() != "rgb8" || message->step() != width * 3 ||
          message->data().size() != width * height * 3) {
        return Error{ErrorCode::kFailed, options_.remote + "/image:o: expected rgb8 without padding, got " +
                                             message->encoding().substr(0, 20) + " of " +
                                             std::to_string(width) + " x " + std::to_string(height) + " in " +
                                             std::to_string(message->data().size()) + " bytes"};
      }
      newest_.stamp_ns = to_ns(message->header().stamp());
      newest_.width = static_cast<int>(width);
      newest_.height = static_cast<int>(height);
      newest_.rgb = std::move(message->data());
    }
    if (newest_.rgb.empty())
      return Error{ErrorCode::kTimeout, options_.remote + "/image:o: no picture has come yet"};
    image = newest_;
    return {};
  }

  Result<CameraInfo> info() const override {
    const std::lock_guard lock(mutex_);
    if (std::optional<msgs::CameraInfo> message = info_->take_latest()) {
      CameraInfo info;
      info.width = static_cast<int>(message->width());
      info.height = static_cast<int>(message->height());
      info.fx_px = message->k()[0];
      info.fy_px = message->k()[4];
      info.cx_px = message->k()[2];
      info.cy_px = message->k()[5];
      const std::vector<double>& d = message->d();
      if (std::any_of(d.begin(), d.end(), [](double value) { return value != 0; })) info.distortion = d;
      newest_info_ = std::move(info);
    }
    if (!newest_info_)
      return Error{ErrorCode::kTimeout, options_.remote + "/camera_info:o: nothing has come yet"};
    return *newest_info_;
  }

 private:
  Node& node_;
  const ClientOptions options_;
  mutable std::mutex mutex_;
  std::unique_ptr<Input<msgs::Image>> image_;
  std::unique_ptr<Input<msgs::CameraInfo>> info_;
  Image newest_;
  mutable std::optional<CameraInfo> newest_info_;
};

}  // namespace

Result<std::unique_ptr<IServer>> serve_camera(Node& node, const std::string& stem, ICamera& camera,
                                              const CameraServing& serving) {
  auto server = std::make_unique<CameraServer>(node, stem, camera, serving);
  if (Status opened = server->open(); !opened) return opened.error();
  return std::unique_ptr<IServer>(std::move(server));
}

Result<std::unique_ptr<ICamera>> camera_client(Node& node, const ClientOptions& options) {
  auto client = std::make_unique<CameraClient>(node, options);
  if (Status opened = client->open(); !opened) return opened.error();
  return std::unique_ptr<ICamera>(std::move(client));
}

}  // namespace nido
