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
  Status stop() override;
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
  };
  CartesianArm(SerialChain chain, IControlBoard& arm, IControlBoard& torso, bool with_torso,
               const IClock& clock)
      : chain_(std::move(chain)), arm_(arm), torso_(torso), with_torso_(with_torso), clock_(clock) {}
  // Joints of the chain now, and when.
  [[nodiscard]] Result<std::pair<Eigen::VectorXd, std::int64_t>> read() const;
  [[nodiscard]] ChainSolution solve(const CartesianGoal& goal, const Eigen::VectorXd& from_rad) const;
  Status stream(const Eigen::VectorXd& q_rad);
  // Ends in mode position, which holds without being told again.
  Status settle(const Eigen::VectorXd& q_rad);

  const SerialChain chain_;
  IControlBoard& arm_;
  IControlBoard& torso_;
  const bool with_torso_;
  const IClock& clock_;
  mutable std::mutex mutex_;
  std::optional<Motion> motion_;
  std::optional<CartesianGoal> goal_;  // the last one
  std::int64_t stepped_ns_ = 0;
};

}  // namespace nido
