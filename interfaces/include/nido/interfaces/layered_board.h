#pragma once

#include "nido/interfaces/control_board.h"

namespace nido {

// A board around a board: hands on what it does not change itself. What moves joints is not handed on by
// itself, so that no layer forgets it.
class LayeredBoard : public IControlBoard {
 public:
  [[nodiscard]] int axes() const override { return inner().axes(); }
  [[nodiscard]] Result<std::string> axis_name(int joint) const override { return inner().axis_name(joint); }
  [[nodiscard]] Result<JointReading> read_joints() const override { return inner().read_joints(); }
  [[nodiscard]] Result<std::vector<JointLimits>> limits() const override { return inner().limits(); }
  [[nodiscard]] Result<std::vector<ControlMode>> control_modes() const override {
    return inner().control_modes();
  }
  [[nodiscard]] Result<std::vector<double>> target_positions() const override {
    return inner().target_positions();
  }
  [[nodiscard]] Result<std::vector<double>> reference_speeds() const override {
    return inner().reference_speeds();
  }
  [[nodiscard]] Result<std::vector<double>> reference_accelerations() const override {
    return inner().reference_accelerations();
  }
  [[nodiscard]] Result<std::vector<bool>> motion_done() const override { return inner().motion_done(); }
  [[nodiscard]] Result<MotorReading> read_motors() const override { return inner().read_motors(); }
  [[nodiscard]] Result<std::vector<bool>> amplifiers_on() const override { return inner().amplifiers_on(); }
  [[nodiscard]] Result<std::vector<Pid>> pids(PidLoop loop) const override { return inner().pids(loop); }
  Status set_pids(PidLoop loop, std::span<const int> joints, std::span<const Pid> pids) override {
    return inner().set_pids(loop, joints, pids);
  }
  [[nodiscard]] Result<PidReading> read_pids(PidLoop loop) const override { return inner().read_pids(loop); }
  [[nodiscard]] Result<std::vector<InteractionMode>> interaction_modes() const override {
    return inner().interaction_modes();
  }
  Status set_interaction_mode(std::span<const int> joints, InteractionMode mode) override {
    return inner().set_interaction_mode(joints, mode);
  }
  [[nodiscard]] Result<std::vector<Impedance>> impedances() const override { return inner().impedances(); }
  Status set_impedances(std::span<const int> joints, std::span<const Impedance> impedances) override {
    return inner().set_impedances(joints, impedances);
  }
  Status calibrate(std::span<const int> joints) override { return inner().calibrate(joints); }
  [[nodiscard]] Result<std::vector<bool>> calibrated() const override { return inner().calibrated(); }
  Status home(std::span<const int> joints) override { return inner().home(joints); }
  [[nodiscard]] Result<std::vector<std::string>> variable_names() const override {
    return inner().variable_names();
  }
  [[nodiscard]] Result<std::string> variable(const std::string& name) const override {
    return inner().variable(name);
  }
  Status set_variable(const std::string& name, const std::string& value) override {
    return inner().set_variable(name, value);
  }

 protected:
  [[nodiscard]] virtual IControlBoard& inner() const = 0;
};

}  // namespace nido
