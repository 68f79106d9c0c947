#include "src/body_server.h"

#include <utility>
#include <vector>

#include "nido/middleware/typed_port.h"

namespace nido {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

msgs::Transform to_message(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond turn(pose.linear());
  msgs::Transform message;
  message.translation().x(pose.translation().x());
  message.translation().y(pose.translation().y());
  message.translation().z(pose.translation().z());
  message.rotation().x(turn.x());
  message.rotation().y(turn.y());
  message.rotation().z(turn.z());
  message.rotation().w(turn.w());
  return message;
}

class BodyServer final : public IServer {
 public:
  BodyServer(const BodyFrames& frames, std::int64_t period_ns) : frames_(frames), due_(period_ns) {}

  Status open(Node& node) {
    auto output = node.open_output<msgs::TFMessage>("/tf", Profile::kEvent, 4);
    if (!output) return output.error();
    output_ = std::move(*output);
    return {};
  }

  Status publish(std::int64_t now_ns) override {
    if (!due_.at(now_ns) || output_->reader_count() == 0) return {};
    const Result<std::vector<BodyFrames::Edge>> edges = frames_.edges();
    if (!edges) return Error{edges.error().code, "/tf: " + edges.error().message};
    msgs::TFMessage message;
    for (const BodyFrames::Edge& edge : *edges) {
      msgs::TransformStamped transform;
      transform.header().stamp().sec(static_cast<std::int32_t>(now_ns / kSecond_ns));
      transform.header().stamp().nanosec(static_cast<std::uint32_t>(now_ns % kSecond_ns));
      transform.header().frame_id(edge.parent);
      transform.child_frame_id(edge.name);
      transform.transform(to_message(edge.X_ParentFrame));
      message.transforms().push_back(std::move(transform));
    }
    return output_->write(message);
  }

 private:
  const BodyFrames& frames_;
  Due due_;
  std::unique_ptr<Output<msgs::TFMessage>> output_;
};

}  // namespace

Result<std::unique_ptr<IServer>> serve_body(Node& node, const BodyFrames& frames, std::int64_t period_ns) {
  auto server = std::make_unique<BodyServer>(frames, period_ns);
  if (Status opened = server->open(node); !opened) return opened.error();
  return std::unique_ptr<IServer>(std::move(server));
}

}  // namespace nido
