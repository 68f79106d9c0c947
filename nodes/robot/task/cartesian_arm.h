#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nido/interfaces/clock.h"
#include "nido/interfaces/control_board.h"
#include "nido/interfaces/device.h"
#include "nido/interfaces/task_control.h"
#include "nido/kinematics/chain_solver.h"

namespace nido {

// The hand of one arm in the space of the task, on any control boards. Step it once a control period, after
// commands have been taken and before the boards' limits are applied. Thread-safe.
class CartesianArm final : public ICartesianControl, public ISteppable {
 public:
  // side: "left", "right". torso: null leaves it where it is, and the arm alone reaches. Boards and clock
  // must outlive the device. Fails when boards and model do not fit.
  static Result<std::unique_ptr<CartesianArm>> create(const RobotModel& model, const std::string& side,
                                                      IControlBoard& arm, IControlBoard& torso,
                                                      bool with_torso, const IClock& clock);

  [[nodiscard]] Result<CartesianState> state() const override;
  [[nodiscard]] Result<CartesianPlan> plan(const CartesianGoal& goal) const override;
  Status go_to(const CartesianGoal& goal) override;
  Status go_on(const Eigen::Vector3d& v_m_s, const Eigen::Vector3d& w_rad_s, double for_s) override;
  Status stop() override;
  [[nodiscard]] Result<Eigen::Isometry3d> X_RootLink(int joint_from_root) const override;
  [[nodiscard]] Result<CartesianSettings> settings() const override;
  Status set_settings(const CartesianSettings& settings) override;
  Status step_to(std::int64_t now_ns) override;

 private:
  struct Motion {
    CartesianGoal goal;
    Eigen::Isometry3d X_RootStart = Eigen::Isometry3d::Identity();
    Eigen::VectorXd start_rad;
    Eigen::VectorXd end_rad;
    Eigen::VectorXd sent_rad;  // what was streamed last
    std::int64_t begin_ns = 0;
    double duration_s = 0;
    double progress = 0;
    std::optional<Eigen::Matrix<double, 6, 1>> speed{};  // of the tip, m/s and rad/s, for duration_s
    bool is_held_up = false;                             // the joints cannot follow this speed any further
  };
  // Joints of the chain.
  struct Posture {
    Eigen::VectorXd q_rad;
    Eigen::VectorXd velocity_rad_s;
    std::int64_t stamp_ns = 0;
  };
  CartesianArm(const SerialChain& chain, IControlBoard& arm, IControlBoard& torso, bool with_torso,
               const IClock& clock);
  [[nodiscard]] Result<Posture> read() const;
  // What the settings leave free.
  [[nodiscard]] ChainOptions options(const Eigen::VectorXd& from_rad) const;
  [[nodiscard]] ChainSolution solve(const CartesianGoal& goal, const Eigen::VectorXd& from_rad) const;
  // Where a motion wants the joints at a time.
  [[nodiscard]] Eigen::VectorXd on_its_way(Motion& motion, std::int64_t now_ns, double dt_s) const;
  [[nodiscard]] bool torso_moves() const;
  void end_motion();
  Status stream(const Eigen::VectorXd& q_rad);
  // Ends in mode position, which holds without being told again.
  Status settle(const Eigen::VectorXd& q_rad);

  const SerialChain palm_;  // the chain up to the palm
  IControlBoard& arm_;
  IControlBoard& torso_;
  const bool with_torso_;
  const IClock& clock_;
  mutable std::mutex mutex_;
  SerialChain chain_;  // up to the tip
  CartesianSettings settings_;
  std::optional<Motion> motion_;
  double progress_ = 1;                // of the last one
  std::uint32_t motions_ = 0;          // begun so far
  std::optional<CartesianGoal> goal_;  // the last one
  std::int64_t stepped_ns_ = 0;
};

}  // namespace nido
