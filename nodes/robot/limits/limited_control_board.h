#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "limits/safety.h"
#include "limits/workspace.h"
#include "nido/interfaces/board_extras.h"
#include "nido/interfaces/clock.h"
#include "nido/interfaces/control_board.h"
#include "nido/interfaces/device.h"
#include "nido/interfaces/layered_board.h"

namespace nido {

struct LimitOptions {
  std::string part;  // of the messages: "left_arm"
  // after the last streamed command its joints stand; the stream ends at 65 of 100 parts of it
  std::int64_t command_timeout_ns = 100'000'000;
  std::vector<JointLimits> narrower{};     // (axes) or empty: only what is narrower than the device's counts
  std::shared_ptr<const Safety> safety{};  // may be null: commands are always allowed
  std::shared_ptr<Workspace> workspace{};  // of all boards of the robot; may be null: no borders
  // told in a sentence when a joint is stopped because nobody goes on; may be empty
  std::function<void(const std::string&)> report{};
  // told in a sentence when a border is met or the device does not stop as it should; may be empty
  std::function<void(const std::string&)> warn{};
};

// The one layer below every client of a board, the same for all families of devices: whatever is commanded,
// - wrong sizes, wrong indices and values that are not finite are refused, with no change;
// - positions, speeds, torques and duty cycles are clamped to the limits in force;
// - a direct target is walked up to with the velocity limit, and ends where it is when not renewed in time;
// - a speed is lowered on the way to a position limit, and ends when not renewed in time;
// - a torque or duty cycle that pushes out of the position limits is dropped, and one not renewed in time is
// replaced by
//   holding the position (mode position).
// - no link is driven beyond a border of the workspace: targets behind it are refused, speeds and direct
//   targets are slowed down before it, and motions of the device's own that lead there are stopped.
// - while the robot's safety forbids it nothing is commanded at all; when the emergency stop comes joints are
//   stopped, again and again until the device has obeyed.
// Call step_to() once a control period, after the commands and before the device's own step. Thread-safe.
class LimitedControlBoard final : public LayeredBoard,
                                  public ICommanded,
                                  public ILimitSettings,
                                  public ICurrentRange,
                                  public ISteppable {
 public:
  // `device` and `clock` must outlive the layer. Fails when the device tells no limits or limits that are out
  // of order.
  static Result<std::unique_ptr<LimitedControlBoard>> create(IControlBoard& device, const IClock& clock,
                                                             LimitOptions options);

  // Renews what the streaming modes command and stops what is out of date. Fails when the device cannot be
  // read or commanded at all.
  Status step_to(std::int64_t now_ns) override;

  [[nodiscard]] int axes() const override;
  [[nodiscard]] Result<std::vector<JointLimits>> limits() const override;
  Status set_control_mode(std::span<const int> joints, ControlMode mode) override;
  Status move_to(std::span<const int> joints, std::span<const double> target_rad) override;
  Status set_reference_speeds(std::span<const int> joints, std::span<const double> speed_rad_s) override;
  Status set_reference_accelerations(std::span<const int> joints,
                                     std::span<const double> acceleration_rad_s2) override;
  Status stop(std::span<const int> joints) override;
  Status set_positions(std::span<const int> joints, std::span<const double> target_rad) override;
  Status set_velocities(std::span<const int> joints, std::span<const double> velocity_rad_s) override;
  Status set_torques(std::span<const int> joints, std::span<const double> torque_Nm) override;
  Status set_duty_cycles(std::span<const int> joints, std::span<const double> duty_cycle) override;
  Status home(std::span<const int> joints) override;
  Status calibrate(std::span<const int> joints) override;
  Status set_pids(PidLoop loop, std::span<const int> joints, std::span<const Pid> pids) override;
  Status set_interaction_mode(std::span<const int> joints, InteractionMode mode) override;
  Status set_impedances(std::span<const int> joints, std::span<const Impedance> impedances) override;
  Status set_variable(const std::string& name, const std::string& value) override;
  [[nodiscard]] Result<std::vector<double>> commanded(ControlMode mode) const override;
  // A motion on its way to beyond the new limits ends at them.
  Status set_position_limits(int joint, double min_rad, double max_rad) override;
  Status set_velocity_limit(int joint, double max_rad_s) override;
  [[nodiscard]] Result<std::vector<double>> greatest_currents() const override;

  // What a joint is being streamed; mode position means that nothing is.
  struct Stream {
    ControlMode mode = ControlMode::kPosition;
    double wanted = 0;            // last command, clamped
    double sent = 0;              // what the device got last
    std::int64_t renewed_ns = 0;  // when the last command came
  };
  // What the layer remembers of what was commanded, to go on from a moment (robot_snapshot.h).
  struct Memory {
    std::vector<Stream> streams;  // (axes)
    std::vector<std::optional<double>>
        target_rad;               // (axes) of motions of the device's own, if they are known
    std::vector<bool> is_driven;  // (axes) by a motion of the device's own
    std::int64_t stepped_ns = 0;
  };
  [[nodiscard]] Memory memory() const;
  // Refused when it is of another number of axes; commands nothing.
  Status set_memory(const Memory& memory);

 private:
  [[nodiscard]] IControlBoard& inner() const override { return device_; }
  LimitedControlBoard(IControlBoard& device, const IClock& clock, LimitOptions options,
                      std::vector<JointLimits> limits);
  [[nodiscard]] Status may_command() const {
    return options_.safety ? options_.safety->may_command() : Status();
  }
  // Carries out the emergency stop; what the device cannot do now is tried again.
  void halt(std::int64_t now_ns);
  Status act_on(std::span<const int> joints);
  // Stops what is about to leave the workspace, among what is not streamed by position or speed.
  Status stay_inside(const JointReading& reading);
  // Stops joints and ends what they were streamed. Fails when the device cannot be commanded at all.
  Status hold(std::span<const int> joints);
  // Slows down before the borders of the workspace what is about to be sent, in modes direct and velocity.
  // The border that made it do so.
  std::optional<std::string> brake(ControlMode mode, std::span<const int> joints, std::span<double> values,
                                   const JointReading& reading, double dt_s);
  Status send_changes(ControlMode mode, std::span<const int> all_joints, std::span<const double> all_values);
  [[nodiscard]] std::vector<int> body_axes(std::span<const int> joints) const;
  void note_targets();
  void tell_border(const std::optional<std::string>& rule);
  Status stream(ControlMode mode, std::span<const int> joints, std::span<const double> values);
  // What may be sent now of what is wanted.
  [[nodiscard]] double allowed(const Stream& stream, const JointLimits& limits, double position_rad,
                               double dt_s) const;
  Status send(ControlMode mode, std::span<const int> joints, std::span<const double> values);
  // Ends the streams of joints that were given over to another mode.
  void forget(std::span<const int> joints);
  void report(int joint, const std::string& what) const;

  IControlBoard& device_;
  const IClock& clock_;
  const LimitOptions options_;
  const std::vector<JointLimits> widest_;  // what the device can and its robot file allows
  mutable std::mutex mutex_;
  std::vector<JointLimits> limits_;  // in force
  std::vector<Stream> streams_;
  std::vector<int> axes_;                          // of the body, of each joint; empty without a workspace
  std::vector<std::optional<double>> target_rad_;  // of motions of the device's own, if they are known
  std::vector<bool> is_driven_;                    // by a motion of the device's own
  std::optional<std::string> border_;              // that was met last, as long as it is
  std::int64_t stepped_ns_ = 0;
  bool is_halted_ = false;         // the emergency stop has been carried out
  std::int64_t next_halt_ns_ = 0;  // when it is tried again
};

// One line a joint: what is in force, for the log at the start. "left_arm 3 l_elbow: 15.0..106.0 deg, 100
// deg/s, 20 N m"
[[nodiscard]] std::vector<std::string> describe_limits(const std::string& part, const IControlBoard& board);

}  // namespace nido
