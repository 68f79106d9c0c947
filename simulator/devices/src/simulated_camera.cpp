#include "nido/simulator/devices/simulated_camera.h"

#include <algorithm>
#include <mutex>
#include <utility>

namespace nido::sim {
namespace {

// even for the left eye's cameras and odd for the right one's, so that the world port can forget what an eye
// shows
std::size_t film_number(Eye eye, std::size_t camera) { return 2 * camera + (eye == Eye::kLeft ? 0 : 1); }

}  // namespace

Result<std::unique_ptr<SimulatedCamera>> SimulatedCamera::create(std::shared_ptr<SimulatedRobot> robot,
                                                                 Eye eye, const Camera& optics,
                                                                 const NoiseOptions& noise) {
  if (Status valid = optics.check(); !valid) return valid.error();
  if (!robot->simulation().has_eye(eye)) return no_such_eye(eye);
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
    : robot_(std::move(robot)),
      eye_(eye),
      camera_(camera),
      noise_(std::move(noise)),
      film_(eye ? film_number(*eye, robot_->add_film()) : 0) {}

Status SimulatedCamera::open_shutter() {
  const std::lock_guard lock(mutex_);
  const std::lock_guard robot_lock(robot_->mutex());
  Camera camera = camera_;
  if (eye_) camera.X_WorldCamera = robot_->simulation().X_WorldCamera(*eye_);
  Darkroom::Finish finish;
  if (eye_) {
    const std::uint64_t moment = robot_->simulation().moment();
    finish = fault_of_picture(moment);
    if (noise_) {
      finish = [noise = noise_, moment, spoil = std::move(finish)](Image& picture) {
        noise->apply(picture, moment);
        if (spoil) spoil(picture);
      };
    }
  }
  picture_ = robot_->begin_picture(camera, std::move(storage_), std::move(finish));
  storage_ = {};
  return {};
}

Darkroom::Finish SimulatedCamera::fault_of_picture(std::uint64_t moment) {
  constexpr int kSlowness = 5;
  constexpr double kGrain_levels = 60;
  const CameraFault fault = robot_->simulation().camera_fault(*eye_);
  Film& film = robot_->simulation().film(film_);
  if (fault != film.fault) film = {.fault = fault};
  switch (fault) {
    case CameraFault::kNone:
      break;
    case CameraFault::kOff:
      return [](Image& picture) { std::fill(picture.rgb.begin(), picture.rgb.end(), std::uint8_t{0}); };
    case CameraFault::kNoise:
      if (!grain_) {
        if (auto made = PictureNoise::create({.noise_levels = kGrain_levels}); made)
          grain_ = std::make_shared<PictureNoise>(std::move(*made));
      }
      return [grain = grain_, moment](Image& picture) {
        if (grain) grain->apply(picture, moment);
      };
    case CameraFault::kStuck:
    case CameraFault::kSlow: {
      // a film of another robot's camera is no use
      const bool has_one = film.width == camera_.width && film.height == camera_.height;
      const bool is_new = !has_one || (fault == CameraFault::kSlow && film.taken % kSlowness == 0);
      ++film.taken;
      if (!is_new) {
        return [film](Image& picture) {
          if (const Image* shown = picture_on(film)) picture.rgb = shown->rgb;
        };
      }
      auto drawn = std::make_shared<std::promise<Image>>();
      film.width = camera_.width;
      film.height = camera_.height;
      film.shown = drawn->get_future().share();
      return [drawn](Image& picture) { drawn->set_value(picture); };
    }
  }
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
