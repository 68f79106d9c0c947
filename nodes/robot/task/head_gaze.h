#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "nido/interfaces/clock.h"
#include "nido/interfaces/control_board.h"
#include "nido/interfaces/device.h"
#include "nido/interfaces/task_control.h"
#include "nido/kinematics/gaze_solver.h"

namespace nido {

// Neck and eyes in the space of the task, on any control boards. Step it once a control period, after
// commands have been taken and before the boards' limits are applied. Thread-safe.
class HeadGaze final : public IGazeControl, public ISteppable {
 public:
  // Boards and clock must outlive the device.
  static Result<std::unique_ptr<HeadGaze>> create(RobotModel model, const PinholeCamera& camera,
                                                  IControlBoard& head, IControlBoard& torso,
                                                  const IClock& clock);

  [[nodiscard]] Result<GazeState> state() const override;
  Status look_at(const Eigen::Vector3d& p_Root_m) override;
  Status look_at_pixel(int eye, const Eigen::Vector2d& px, double distance_m) override;
  Status look_at_pixels(const Eigen::Vector2d& left_px, const Eigen::Vector2d& right_px) override;
  Status look_by_angles(bool relative, const Eigen::Vector3d& angles_rad) override;
  Status stop() override;
  [[nodiscard]] Result<GazeBody> body() const override { return body_; }
  [[nodiscard]] Result<GazeSettings> settings() const override;
  Status set_settings(const GazeSettings& settings) override;
  Status step_to(std::int64_t now_ns) override;

 private:
  struct Motion {
    Eigen::Vector3d p_Root_m = Eigen::Vector3d::Zero();
    HeadAngles start_rad;
    HeadAngles end_rad;
    HeadAngles sent_rad;
    std::int64_t begin_ns = 0;
    double neck_s = 0;
    double eyes_s = 0;
    bool moving = true;
    double progress = 0;
  };
  HeadGaze(std::unique_ptr<RobotModel> model, int head_link, GazeSolver solver, IControlBoard& head,
           IControlBoard& torso, const IClock& clock)
      : model_(std::move(model)),
        head_link_(head_link),
        solver_(solver),
        head_(head),
        torso_(torso),
        clock_(clock) {}
  // Joints, eyes and head as they are, without what belongs to a motion.
  [[nodiscard]] Result<GazeState> read() const;
  // Optical frames, left and right, and the head.
  void place(GazeState& state) const;
  // How far the settings let the head turn.
  [[nodiscard]] HeadRange range() const;
  // The eyes that see the point with the neck as it is.
  [[nodiscard]] HeadAngles with_neck_held(const Eigen::Vector3d& p_Root_m, const TorsoAngles& torso_rad,
                                          const HeadAngles& head_rad) const;

  // Whether a motion that begins now is a saccade; notes it.
  bool jumps_to(const Eigen::Vector3d& p_Root_m, const GazeState& now, std::int64_t now_ns);

  const std::unique_ptr<RobotModel> model_;  // what the solver looks at
  const int head_link_;
  const GazeSolver solver_;
  GazeBody body_;
  IControlBoard& head_;
  IControlBoard& torso_;
  const IClock& clock_;
  mutable std::mutex mutex_;
  GazeSettings settings_;
  double progress_ = 1;  // of the motion before
  std::optional<std::int64_t> last_saccade_ns_;
  std::optional<Motion> motion_;  // also while the point is only kept in sight
};

}  // namespace nido
