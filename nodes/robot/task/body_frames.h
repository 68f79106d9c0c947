#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "nido/interfaces/clock.h"
#include "nido/interfaces/control_board.h"
#include "nido/interfaces/frame_transforms.h"
#include "nido/kinematics/robot_model.h"

namespace nido {

// Frames of a body, by the encoders of any control boards. Joints that no board has stay at zero.
// Thread-safe.
class BodyFrames final : public IFrameTransforms {
 public:
  // Boards and clock must outlive the device. kNotFound for a board's joint that the body does not have.
  static Result<std::unique_ptr<BodyFrames>> create(RobotModel model,
                                                    std::vector<const IControlBoard*> boards,
                                                    const IClock& clock);

  [[nodiscard]] Result<std::vector<Frame>> frames() const override;
  [[nodiscard]] Result<FrameTransform> transform(const std::string& base,
                                                 const std::string& frame) const override;
  Status put(const std::string& parent, const std::string& name,
             const Eigen::Isometry3d& X_ParentFrame) override;
  Status remove(const std::string& name) override;

  // Each frame that has a parent, seen from it; with encoders of any age.
  struct Edge {
    std::string parent;
    std::string name;
    Eigen::Isometry3d X_ParentFrame;
  };
  [[nodiscard]] Result<std::vector<Edge>> edges() const;

 private:
  struct Put {
    std::string parent;
    Eigen::Isometry3d X_ParentFrame;
  };
  struct Body {
    std::vector<Eigen::Isometry3d> X_RootLinks;
    std::int64_t stamp_ns = 0;
  };
  BodyFrames(RobotModel model, std::vector<const IControlBoard*> boards, const IClock& clock)
      : model_(std::move(model)), boards_(std::move(boards)), clock_(clock) {}
  [[nodiscard]] Result<Body> read() const;
  // Up from a frame, as far as frames that were put lead: their end, and the pose seen from there. The lock
  // is held.
  [[nodiscard]] std::pair<std::string, Eigen::Isometry3d> climb(const std::string& name) const;
  [[nodiscard]] bool is_known(const std::string& name) const;

  const RobotModel model_;
  const std::vector<const IControlBoard*> boards_;
  std::vector<std::vector<int>> axes_;  // of each board: its joints' places in a vector of all axes
  const IClock& clock_;
  mutable std::mutex mutex_;
  std::map<std::string, Put> put_;
};

}  // namespace nido
