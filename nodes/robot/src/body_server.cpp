#include "src/body_server.h"

#include <algorithm>
#include <string>
#include <utility>

#include "nido/kinematics/robot_model.h"
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
  BodyServer(RobotModel model, std::vector<const IControlBoard*> boards, std::int64_t period_ns)
      : model_(std::move(model)), boards_(std::move(boards)), due_(period_ns) {}

  Status open(Node& node) {
    for (const IControlBoard* board : boards_) {
      std::vector<int>& places = axes_.emplace_back();
      for (int joint = 0; joint < board->axes(); ++joint) {
        const Result<std::string> name = board->axis_name(joint);
        if (!name) return name.error();
        const Result<int> axis = model_.axis_index(*name);
        if (!axis) return axis.error();
        places.push_back(*axis);
      }
    }
    auto output = node.open_output<msgs::TFMessage>("/tf", Profile::kEvent, 4);
    if (!output) return output.error();
    output_ = std::move(*output);
    return {};
  }

  Status publish(std::int64_t now_ns) override {
    if (!due_.at(now_ns) || output_->reader_count() == 0) return {};
    Eigen::VectorXd axes_rad = model_.zero_axes();
    for (std::size_t b = 0; b < boards_.size(); ++b) {
      const Result<JointReading> reading = boards_[b]->read_joints();
      if (!reading) return Error{reading.error().code, "/tf: " + reading.error().message};
      for (std::size_t j = 0; j < axes_[b].size(); ++j) axes_rad[axes_[b][j]] = reading->position_rad[j];
    }
    const std::vector<Eigen::Isometry3d> X_RootLinks = model_.X_RootLinks(model_.hinge_angles(axes_rad));
    msgs::TFMessage message;
    for (std::size_t i = 0; i < X_RootLinks.size(); ++i) {
      const BodyLink& link = model_.links()[i];
      if (link.parent < 0) continue;  // the root has no parent
      const auto parent = static_cast<std::size_t>(link.parent);
      msgs::TransformStamped transform;
      transform.header().stamp().sec(static_cast<std::int32_t>(now_ns / kSecond_ns));
      transform.header().stamp().nanosec(static_cast<std::uint32_t>(now_ns % kSecond_ns));
      transform.header().frame_id(model_.links()[parent].name);
      transform.child_frame_id(link.name);
      transform.transform(to_message(X_RootLinks[parent].inverse() * X_RootLinks[i]));
      message.transforms().push_back(std::move(transform));
    }
    return output_->write(message);
  }

 private:
  const RobotModel model_;
  const std::vector<const IControlBoard*> boards_;
  std::vector<std::vector<int>> axes_;  // of each board: its joints' places in a vector of all axes
  Due due_;
  std::unique_ptr<Output<msgs::TFMessage>> output_;
};

}  // namespace

Result<std::unique_ptr<IServer>> serve_body(Node& node, const std::filesystem::path& urdf,
                                            std::vector<const IControlBoard*> boards,
                                            std::int64_t period_ns) {
  Result<RobotModel> model = RobotModel::load(urdf);
  if (!model) return model.error();
  auto server = std::make_unique<BodyServer>(std::move(*model), std::move(boards), period_ns);
  if (Status opened = server->open(node); !opened) return opened.error();
  return std::unique_ptr<IServer>(std::move(server));
}

}  // namespace nido
