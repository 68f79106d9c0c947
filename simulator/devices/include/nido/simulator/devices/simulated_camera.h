#pragma once

#include <future>
#include <memory>
#include <mutex>
#include <optional>

#include "nido/interfaces/camera.h"
#include "nido/simulator/devices/simulated_robot.h"
#include "nido/simulator/render/picture_noise.h"

namespace nido::sim {

// A camera of the simulated robot, in an eye or fixed in the world. An ideal pinhole. Draws when it is asked
// for a picture, or from the opening of its shutter on, beside the simulation. Thread-safe.
class SimulatedCamera final : public ICamera, public IShutter {
 public:
  // The camera of an eye; only its optics are taken from `optics`, the pose follows the eye. `noise` is what
  // a real camera adds to the ideal picture.
  static Result<std::unique_ptr<SimulatedCamera>> create(std::shared_ptr<SimulatedRobot> robot, Eye eye,
                                                         const Camera& optics,
                                                         const NoiseOptions& noise = {});
  // A camera that stays where it is, without noise.
  static Result<std::unique_ptr<SimulatedCamera>> create_fixed(std::shared_ptr<SimulatedRobot> robot,
                                                               const Camera& camera);

  Status grab(Image& image) override;
  Status open_shutter() override;
  [[nodiscard]] Result<CameraInfo> info() const override;

 private:
  SimulatedCamera(std::shared_ptr<SimulatedRobot> robot, std::optional<Eye> eye, const Camera& camera,
                  std::shared_ptr<PictureNoise> noise);

  std::shared_ptr<SimulatedRobot> robot_;
  std::optional<Eye> eye_;
  const Camera camera_;
  const std::shared_ptr<PictureNoise> noise_;  // used by the drawing thread alone; null: none
  // What the fault that the eye has does to the picture that is taken now; empty: nothing. Under the robot's
  // lock.
  Darkroom::Finish fault_of_picture(std::uint64_t moment);
  std::shared_ptr<PictureNoise> grain_;  // of an eye whose fault is noise; used by the drawing thread
  const std::size_t film_;               // of an eye
  std::mutex mutex_;
  std::optional<std::future<Result<Image>>> picture_;  // taken, not delivered yet
  Image storage_;                                      // of the next picture
};

}  // namespace nido::sim
