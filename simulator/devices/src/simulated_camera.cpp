#include "nido/simulator/devices/simulated_camera.h"

#include <algorithm>
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
  const CameraFault fault = eye_ ? robot_->simulation().camera_fault(*eye_) : CameraFault::kNone;
  const bool is_faulty = fault != CameraFault::kNone;
  Darkroom::Finish finish;
  if (noise_ || is_faulty || was_faulty_) {
    const std::uint64_t moment = robot_->simulation().moment();
    finish = [noise = noise_, faulty = faulty_, fault, moment](Image& picture) {
      if (noise) noise->apply(picture, moment);
      spoil(*faulty, fault, moment, picture);
    };
  }
  was_faulty_ = is_faulty;
  picture_ = robot_->begin_picture(camera, std::move(storage_), std::move(finish));
  storage_ = {};
  return {};
}

void SimulatedCamera::spoil(Faulty& faulty, CameraFault fault, std::uint64_t moment, Image& picture) {
  constexpr int kSlowness = 5;
  constexpr double kGrain_levels = 60;
  if (fault != faulty.fault) faulty = {.fault = fault};
  switch (fault) {
    case CameraFault::kNone:
      return;
    case CameraFault::kOff:
      std::fill(picture.rgb.begin(), picture.rgb.end(), std::uint8_t{0});
      break;
    case CameraFault::kNoise:
      if (!faulty.grain) {
        if (auto made = PictureNoise::create({.noise_levels = kGrain_levels}); made)
          faulty.grain = std::move(*made);
      }
      if (faulty.grain) faulty.grain->apply(picture, moment);
      break;
    case CameraFault::kStuck:
    case CameraFault::kSlow:
      if (faulty.taken == 0 || (fault == CameraFault::kSlow && faulty.taken % kSlowness == 0)) {
        faulty.held.rgb = picture.rgb;
      } else {
        picture.rgb = faulty.held.rgb;
      }
      break;
  }
  ++faulty.taken;
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
