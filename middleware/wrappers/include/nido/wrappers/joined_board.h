#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "nido/interfaces/board_extras.h"
#include "nido/interfaces/control_board.h"

namespace nido {

// A joint of a board, which outlives what is made of it.
struct JointOf {
  IControlBoard* board = nullptr;
  int joint = 0;
};

// One board made of joints of several: torso and arm in one, in any order, some joints left out. The boards
// may be here or far away, of one robot or of two. Limits, modes and streams are those of the boards.
// Thread-safe as they are.
//
// A reading is as old as the oldest of its parts; where one board does not measure something, the list is
// empty. A command is checked whole before a board gets its part of it. If one board refuses its part all the
// same (a joint in mode fault, a board that does not answer), the joints of those that have taken theirs are
// stopped, and its refusal is the answer. Variables are called "0.NAME", "1.NAME", ...: of the first board,
// the second, ...
class JoinedBoard final : public IControlBoard,
                          public ICommanded,
                          public ILimitSettings,
                          public ICurrentRange {
 public:
  // kInvalidArgument for no joints, a joint that its board does not have, and one that is named twice.
  static Result<std::unique_ptr<JoinedBoard>> create(std::vector<JointOf> joints);

  [[nodiscard]] int axes() const override { return static_cast<int>(joints_.size()); }
  [[nodiscard]] Result<std::string> axis_name(int joint) const override;
  [[nodiscard]] Result<JointReading> read_joints() const override;
  [[nodiscard]] Result<std::vector<JointLimits>> limits() const override;
  [[nodiscard]] Result<std::vector<ControlMode>> control_modes() const override;
  Status set_control_mode(std::span<const int> joints, ControlMode mode) override;
  Status move_to(std::span<const int> joints, std::span<const double> target_rad) override;
  [[nodiscard]] Result<std::vector<double>> target_positions() const override;
  Status set_reference_speeds(std::span<const int> joints, std::span<const double> speed_rad_s) override;
  [[nodiscard]] Result<std::vector<double>> reference_speeds() const override;
  Status set_reference_accelerations(std::span<const int> joints,
                                     std::span<const double> acceleration_rad_s2) override;
  [[nodiscard]] Result<std::vector<double>> reference_accelerations() const override;
  [[nodiscard]] Result<std::vector<bool>> motion_done() const override;
  Status stop(std::span<const int> joints) override;
  Status set_positions(std::span<const int> joints, std::span<const double> target_rad) override;
  Status set_velocities(std::span<const int> joints, std::span<const double> velocity_rad_s) override;
  Status set_torques(std::span<const int> joints, std::span<const double> torque_Nm) override;
  Status set_duty_cycles(std::span<const int> joints, std::span<const double> duty_cycle) override;
  [[nodiscard]] Result<MotorReading> read_motors() const override;
  [[nodiscard]] Result<std::vector<bool>> amplifiers_on() const override;
  [[nodiscard]] Result<std::vector<Pid>> pids(PidLoop loop) const override;
  Status set_pids(PidLoop loop, std::span<const int> joints, std::span<const Pid> pids) override;
  [[nodiscard]] Result<PidReading> read_pids(PidLoop loop) const override;
  [[nodiscard]] Result<std::vector<InteractionMode>> interaction_modes() const override;
  Status set_interaction_mode(std::span<const int> joints, InteractionMode mode) override;
  [[nodiscard]] Result<std::vector<Impedance>> impedances() const override;
  Status set_impedances(std::span<const int> joints, std::span<const Impedance> impedances) override;
  Status calibrate(std::span<const int> joints) override;
  [[nodiscard]] Result<std::vector<bool>> calibrated() const override;
  Status home(std::span<const int> joints) override;
  [[nodiscard]] Result<std::vector<std::string>> variable_names() const override;
  [[nodiscard]] Result<std::string> variable(const std::string& name) const override;
  Status set_variable(const std::string& name, const std::string& value) override;
  // Of boards that can tell or do it; kUnsupported when one cannot.
  [[nodiscard]] Result<std::vector<double>> commanded(ControlMode mode) const override;
  Status set_position_limits(int joint, double min_rad, double max_rad) override;
  Status set_velocity_limit(int joint, double max_rad_s) override;
  [[nodiscard]] Result<std::vector<double>> greatest_currents() const override;

 private:
  explicit JoinedBoard(std::vector<JointOf> joints);
  // What each board tells, one reading a board.
  template <class T, class Read>
  Result<std::vector<T>> readings(Read read) const;
  // Of a list that each board tells, the joints of this one.
  template <class T, class Read>
  Result<std::vector<T>> gathered(Read read) const;
  // The joints' values out of a list that each board's reading has; empty when a board's list is.
  template <class T, class Whole>
  std::vector<T> picked(const std::vector<Whole>& wholes, std::vector<T> Whole::*list) const;
  // Hands each board its part of a checked command: command(board, joints, places of their values).
  template <class Command>
  Status split(std::span<const int> joints, Command command);
  // The same with values for the joints; `moves`: what was taken is stopped when another board refuses.
  template <class T, class Command>
  Status split_values(std::span<const int> joints, std::span<const T> values, bool moves, Command command);
  // "1.note": the second board, note
  [[nodiscard]] Result<std::pair<IControlBoard*, std::string>> owner_of(const std::string& variable) const;

  struct Place {
    std::size_t board = 0;  // of boards_
    int joint = 0;
  };
  std::vector<IControlBoard*> boards_;  // each once
  std::vector<Place> joints_;
};

}  // namespace nido
