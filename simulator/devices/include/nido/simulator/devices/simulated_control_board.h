#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "nido/interfaces/board_extras.h"
#include "nido/interfaces/control_board.h"
#include "nido/simulator/devices/simulated_robot.h"

namespace nido::sim {

// One part of the simulated robot as a control board. Trajectories of mode position are minimum-jerk with the
// reference speed: accelerations cannot be set. Thread-safe.
class SimulatedControlBoard final : public IControlBoard, public ICurrentRange {
 public:
  // part: "head", "torso", "left_arm", ... kInvalidArgument, with the names that exist, for any other.
  static Result<std::unique_ptr<SimulatedControlBoard>> create(std::shared_ptr<SimulatedRobot> robot,
                                                               std::string_view part);

  [[nodiscard]] int axes() const override;
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
  // Motors turn as their joints do, and do not measure their temperature; duty cycle and current go with the
  // torque, 3 A at the greatest one. Of the loops the one of position has a gain: its kp can be set, 1..100
  // 1/s; the others have none, what is wanted of them is there as far as the torque goes. The joints are
  // stiff.
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
  // What programs for the iCub want to know of its motors, as far as simulated ones have it; fixed.
  Status set_variable(const std::string& name, const std::string& value) override;
  [[nodiscard]] Result<std::vector<double>> greatest_currents() const override;

 private:
  SimulatedControlBoard(std::shared_ptr<SimulatedRobot> robot, int part);
  Status command(JointMode mode, std::span<const int> joints, std::span<const double> values);

  std::shared_ptr<SimulatedRobot> robot_;
  int part_;
  std::vector<JointInfo> joints_;  // fixed: read without the lock
};

}  // namespace nido::sim
