#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nido/interfaces/board_extras.h"
#include "nido/interfaces/layered_board.h"
#include "nido/middleware/time.h"

namespace nido {

// A board to which commands come on two roads: orders, answered at once on a thread of their own, and
// streamed commands, which wait for the next control period. A streamed command that was written before an
// order would be applied after it: a speed under way would set a joint in motion again that was stopped. So
// for the joints of an order, streamed commands that were written before it are void.
//
// "Before" is told by the wall clock that both are written with: of one computer, or of two that keep the
// same time. Thread-safe.
class OrderedBoard final : public LayeredBoard,
                           public ICommanded,
                           public ILimitSettings,
                           public ICurrentRange {
 public:
  // `board` must outlive this.
  explicit OrderedBoard(IControlBoard& board);

  // A command of the stream, written at this wall time. Joints for which it is void are left out.
  Status apply_streamed(Time written, const std::string& mode, std::span<const int> joints,
                        std::span<const double> values);

  // these do not end a streamed command
  Status set_reference_speeds(std::span<const int> joints, std::span<const double> speed_rad_s) override {
    return board_.set_reference_speeds(joints, speed_rad_s);
  }
  Status set_reference_accelerations(std::span<const int> joints,
                                     std::span<const double> acceleration_rad_s2) override {
    return board_.set_reference_accelerations(joints, acceleration_rad_s2);
  }
  // orders
  Status set_control_mode(std::span<const int> joints, ControlMode mode) override;
  Status move_to(std::span<const int> joints, std::span<const double> target_rad) override;
  Status stop(std::span<const int> joints) override;
  Status set_positions(std::span<const int> joints, std::span<const double> target_rad) override;
  Status set_velocities(std::span<const int> joints, std::span<const double> velocity_rad_s) override;
  Status set_torques(std::span<const int> joints, std::span<const double> torque_Nm) override;
  Status set_duty_cycles(std::span<const int> joints, std::span<const double> duty_cycle) override;
  Status home(std::span<const int> joints) override;
  // kUnsupported where the board below does not have it
  [[nodiscard]] Result<std::vector<double>> commanded(ControlMode mode) const override;
  Status set_position_limits(int joint, double min_rad, double max_rad) override;
  Status set_velocity_limit(int joint, double max_rad_s) override;
  [[nodiscard]] Result<std::vector<double>> greatest_currents() const override;

 private:
  [[nodiscard]] IControlBoard& inner() const override { return board_; }
  void void_older(std::span<const int> joints);
  Status apply(ControlMode mode, std::span<const int> joints, std::span<const double> values);

  IControlBoard& board_;
  std::mutex mutex_;  // held while a streamed command is judged and applied
  std::vector<std::optional<std::int64_t>> ordered_ns_;  // by joint: wall time of its last order
  std::int64_t wall_minus_steady_ns_ = 0;                // at the last order
};

}  // namespace nido
