#include "nido/simulator/devices/simulated_depth_camera.h"

#include <mutex>

#include "nido/simulator/scene_labels.h"

namespace nido::sim {

Result<std::unique_ptr<SimulatedDepthCamera>> SimulatedDepthCamera::create(
    std::shared_ptr<SimulatedRobot> robot, Eye eye, const Camera& optics) {
  if (Status valid = optics.check(); !valid) return valid.error();
  if (!robot->simulation().has_eye(eye)) return no_such_eye(eye);
  return std::unique_ptr<SimulatedDepthCamera>(new SimulatedDepthCamera(std::move(robot), eye, optics));
}

Status SimulatedDepthCamera::measure(DepthPicture& picture) {
  std::future<Result<DepthImage>> drawn;
  std::shared_ptr<const SceneSnapshot> scene;
  std::int64_t now_ns = 0;
  {
    const std::lock_guard lock(robot_->mutex());
    Camera camera = camera_;
    camera.X_WorldCamera = robot_->simulation().X_WorldCamera(eye_);
    now_ns = robot_->now_ns();
    scene = robot_->scene();
    drawn = robot_->begin_depth(camera);
  }
  Result<DepthImage> depth = drawn.get();
  if (!depth) return depth.error();
  const std::vector<std::uint16_t> label_of = instance_labels(*scene);
  picture.stamp_ns = now_ns;
  picture.width = depth->width;
  picture.height = depth->height;
  picture.z_m = std::move(depth->z_m);
  picture.label.resize(depth->instance.size());
  for (std::size_t i = 0; i < depth->instance.size(); ++i) {
    const std::uint32_t instance = depth->instance[i];
    picture.label[i] = instance == 0 || instance > label_of.size() ? 0 : label_of[instance - 1];
  }
  return {};
}

Result<std::vector<std::string>> SimulatedDepthCamera::labels() const {
  const std::lock_guard lock(robot_->mutex());
  return scene_labels(*robot_->scene());
}

Result<CameraInfo> SimulatedDepthCamera::info() const {
  return CameraInfo{
      camera_.width, camera_.height, camera_.fx_px, camera_.fy_px, camera_.cx_px, camera_.cy_px, {}};
}

}  // namespace nido::sim
