#include "nido/simulator/devices/simulated_camera.h"

#include <mutex>
#include <utility>

namespace nido::sim {

Result<std::unique_ptr<SimulatedCamera>> SimulatedCamera::create(std::shared_ptr<SimulatedRobot> robot,
                                                                 Eye eye, const Camera& optics) {
  if (Status valid = optics.check(); !valid) return valid.error();
  return std::unique_ptr<SimulatedCamera>(new SimulatedCamera(std::move(robot), eye, optics));
}

Result<std::unique_ptr<SimulatedCamera>> SimulatedCamera::create_fixed(std::shared_ptr<SimulatedRobot> robot,
                                                                       const Camera& camera) {
  if (Status valid = camera.check(); !valid) return valid.error();
  return std::unique_ptr<SimulatedCamera>(new SimulatedCamera(std::move(robot), std::nullopt, camera));
}

SimulatedCamera::SimulatedCamera(std::shared_ptr<SimulatedRobot> robot, std::optional<Eye> eye,
                                 const Camera& camera)
    : robot_(std::move(robot)), eye_(eye), camera_(camera) {}

Status SimulatedCamera::open_shutter() {
  const std::lock_guard lock(mutex_);
  const std::lock_guard robot_lock(robot_->mutex());
  Camera camera = camera_;
  if (eye_) camera.X_WorldCamera = robot_->simulation().X_WorldCamera(*eye_);
  picture_ = robot_->begin_picture(camera, std::move(storage_));
  storage_ = {};
  return {};
}

Status SimulatedCamera::grab(Image& image) {
  std::unique_lock lock(mutex_);
  if (!picture_) {
    lock.unlock();
    if (Status opened = open_shutter(); !opened) return opened;
    lock.lock();
    // somebody else was quicker and took this picture: take another one
    if (!picture_) {
      lock.unlock();
      return grab(image);
    }
  }
  Result<Image> picture = picture_->get();
  picture_.reset();
  if (!picture) return picture.error();
  storage_ = std::exchange(image, std::move(*picture));
  return {};
}

Result<CameraInfo> SimulatedCamera::info() const {
  return CameraInfo{
      camera_.width, camera_.height, camera_.fx_px, camera_.fy_px, camera_.cx_px, camera_.cy_px, {}};
}

}  // namespace nido::sim
