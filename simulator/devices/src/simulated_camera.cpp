#include "nido/simulator/devices/simulated_camera.h"

#include <mutex>
#include <utility>

namespace nido::sim {

Result<std::unique_ptr<SimulatedCamera>> SimulatedCamera::create(std::shared_ptr<SimulatedRobot> robot,
                                                                 Eye eye, const Camera& optics,
                                                                 const NoiseOptions& noise) {
  if (Status valid = optics.check(); !valid) return valid.error();
  std::shared_ptr<PictureNoise> made;
  if (noise.blur_px != 0 || noise.noise_levels != 0) {
    Result<PictureNoise> result = PictureNoise::create(noise);
    if (!result) return result.error();
    made = std::make_shared<PictureNoise>(std::move(*result));
  }
  return std::unique_ptr<SimulatedCamera>(
      new SimulatedCamera(std::move(robot), eye, optics, std::move(made)));
}

Result<std::unique_ptr<SimulatedCamera>> SimulatedCamera::create_fixed(std::shared_ptr<SimulatedRobot> robot,
                                                                       const Camera& camera) {
  if (Status valid = camera.check(); !valid) return valid.error();
  return std::unique_ptr<SimulatedCamera>(
      new SimulatedCamera(std::move(robot), std::nullopt, camera, nullptr));
}

SimulatedCamera::SimulatedCamera(std::shared_ptr<SimulatedRobot> robot, std::optional<Eye> eye,
                                 const Camera& camera, std::shared_ptr<PictureNoise> noise)
    : robot_(std::move(robot)), eye_(eye), camera_(camera), noise_(std::move(noise)) {}

Status SimulatedCamera::open_shutter() {
  const std::lock_guard lock(mutex_);
  const std::lock_guard robot_lock(robot_->mutex());
  Camera camera = camera_;
  if (eye_) camera.X_WorldCamera = robot_->simulation().X_WorldCamera(*eye_);
  Darkroom::Finish finish;
  if (noise_) finish = [noise = noise_](Image& picture) { noise->apply(picture); };
  picture_ = robot_->begin_picture(camera, std::move(storage_), std::move(finish));
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
