#pragma once

#include <memory>

#include "nido/interfaces/depth_camera.h"
#include "nido/simulator/devices/simulated_robot.h"

namespace nido::sim {

// Depth and segmentation in an eye of the simulated robot, exact, without noise. Thread-safe.
class SimulatedDepthCamera final : public IDepthCamera {
 public:
  // Only the optics are taken from `optics`, the pose follows the eye.
  static Result<std::unique_ptr<SimulatedDepthCamera>> create(std::shared_ptr<SimulatedRobot> robot, Eye eye,
                                                              const Camera& optics);

  Status measure(DepthPicture& picture) override;
  [[nodiscard]] Result<std::vector<std::string>> labels() const override;
  [[nodiscard]] Result<CameraInfo> info() const override;

 private:
  SimulatedDepthCamera(std::shared_ptr<SimulatedRobot> robot, Eye eye, const Camera& optics)
      : robot_(std::move(robot)), eye_(eye), camera_(optics) {}

  const std::shared_ptr<SimulatedRobot> robot_;
  const Eye eye_;
  const Camera camera_;
};

}  // namespace nido::sim
