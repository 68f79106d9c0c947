#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/control_board.h"
#include "nido/interfaces/device.h"

namespace nido {

// One joint of a fake board.
struct FakeJoint {
  std::string name;
  JointLimits limits;
  double start_rad = 0;                // where it is at the start
  double reference_speed_rad_s = 0.5;  // of position mode at the start
};

// What a fake board can be told to do wrong.
struct FakeFailures {
  std::optional<Error> commands{};  // every command is refused with this
  std::optional<Error> reads{};     // every reading fails with this
  std::optional<Error> step{};      // the device itself fails with this
};

// A control board without a body: joints go exactly where they are told, as fast as the mode allows, without
// inertia. Torque and pwm move a joint with the same part of its top speed as they are of the greatest
// torque. For trying out programs and for tests of what is built on top; fails on demand. Thread-safe.
class FakeControlBoard final : public IControlBoard, public ISteppable {
 public:
  // The joints' limits must be in order and finite; a start beyond them is clamped.
  explicit FakeControlBoard(std::vector<FakeJoint> joints, std::int64_t start_ns = 0);

  // Failures last until they are set otherwise.
  void set_failures(FakeFailures failures);
  // The same, from a time of the robot's clock on.
  void schedule_failures(std::int64_t at_ns, FakeFailures failures);
  // Breaks a joint: mode fault, no command is taken. `false` repairs it: mode idle.
  void set_fault(int joint, bool broken);

  Status step_to(std::int64_t now_ns) override;

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
  // All loops have gains, which nothing depends on; a compliant joint is so in name.
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

 private:
  struct Joint {
    FakeJoint fixed;
    ControlMode mode = ControlMode::kPosition;
    double command = 0;  // rad, rad/s, N m or duty cycle, by mode
    double position_rad = 0;
    double velocity_rad_s = 0;
    double acceleration_rad_s2 = 0;
    double torque_Nm = 0;
    double reference_speed_rad_s = 0;
    double reference_acceleration_rad_s2 = 0;
    // minimum-jerk motion of mode position; over when elapsed_s has reached duration_s
    double from_rad = 0;
    double elapsed_s = 0;
    double duration_s = 0;
    std::array<Pid, 4> pids;  // by PidLoop
    InteractionMode interaction = InteractionMode::kStiff;
    Impedance impedance;
    bool calibrated = true;
  };
  // Checks and then applies one command to each joint. Takes the lock.
  Status command(ControlMode mode, std::span<const int> joints, std::span<const double> values);
  Status check_commandable(std::span<const int> joints) const;
  static void begin(Joint& joint, ControlMode mode, double value);
  static void advance(Joint& joint, double dt_s);

  mutable std::mutex mutex_;
  std::vector<Joint> joints_;
  std::string note_;  // the one variable
  std::int64_t now_ns_ = 0;
  FakeFailures failures_;
  std::int64_t failures_at_ns_ = 0;
  std::optional<FakeFailures> scheduled_;  // failures from failures_at_ns_ on
};

}  // namespace nido
