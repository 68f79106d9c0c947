#include "src/depth_server.h"

#include <cstring>
#include <utility>

#include "nido/middleware/typed_port.h"

namespace nido {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

class DepthServer final : public IServer {
 public:
  DepthServer(std::string stem, IDepthCamera& camera, std::int64_t period_ns, std::string frame_id)
      : stem_(std::move(stem)), camera_(camera), due_(period_ns), frame_id_(std::move(frame_id)) {}

  Status open(Node& node) {
    auto depth = node.open_output<msgs::Image>(stem_ + "/depth:o", Profile::kSensor);
    if (!depth) return depth.error();
    depth_ = std::move(*depth);
    auto segmentation = node.open_output<msgs::Image>(stem_ + "/segmentation:o", Profile::kSensor);
    if (!segmentation) return segmentation.error();
    segmentation_ = std::move(*segmentation);
    return {};
  }

  Status publish(std::int64_t now_ns) override {
    if (!due_.at(now_ns) || (depth_->reader_count() == 0 && segmentation_->reader_count() == 0)) return {};
    if (Status measured = camera_.measure(picture_); !measured)
      return Error{measured.error().code, stem_ + ": " + measured.error().message};
    if (Status written = write(*depth_, "32FC1", picture_.z_m); !written) return written;
    return write(*segmentation_, "16UC1", picture_.label);
  }

 private:
  template <class Pixel>
  Status write(Output<msgs::Image>& output, const char* encoding, const std::vector<Pixel>& pixels) {
    msgs::Image message;
    message.header().stamp().sec(static_cast<std::int32_t>(picture_.stamp_ns / kSecond_ns));
    message.header().stamp().nanosec(static_cast<std::uint32_t>(picture_.stamp_ns % kSecond_ns));
    message.header().frame_id(frame_id_);
    message.width(static_cast<std::uint32_t>(picture_.width));
    message.height(static_cast<std::uint32_t>(picture_.height));
    message.encoding(encoding);
    message.is_bigendian(0);
    message.step(static_cast<std::uint32_t>(static_cast<std::size_t>(picture_.width) * sizeof(Pixel)));
    message.data().resize(pixels.size() * sizeof(Pixel));
    std::memcpy(message.data().data(), pixels.data(), message.data().size());
    return output.write(message);
  }

  const std::string stem_;
  IDepthCamera& camera_;
  Due due_;
  const std::string frame_id_;
  DepthPicture picture_;
  std::unique_ptr<Output<msgs::Image>> depth_;
  std::unique_ptr<Output<msgs::Image>> segmentation_;
};

}  // namespace

Result<std::unique_ptr<IServer>> serve_depth(Node& node, const std::string& stem, IDepthCamera& camera,
                                             std::int64_t period_ns, const std::string& frame_id) {
  auto server = std::make_unique<DepthServer>(stem, camera, period_ns, frame_id);
  if (Status opened = server->open(node); !opened) return opened.error();
  return std::unique_ptr<IServer>(std::move(server));
}

}  // namespace nido
