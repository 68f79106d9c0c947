#pragma once

#include <string>
#include <vector>

#include "nido/interfaces/control_board.h"
#include "nido/textproto/text_value.h"

namespace nido {

// A board whose motors, loops and calibration are asked for by the control-board vocabulary, whatever carries
// the lines. Thread-safe if ask_line() is.
class AskedBoard : public IControlBoard {
 public:
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

 protected:
  // The words of an answer that is no refusal; the reason otherwise.
  [[nodiscard]] virtual Result<std::vector<TextValue>> ask_line(const std::string& line) const = 0;

 private:
  // the list of axes() numbers in an answer
  [[nodiscard]] Result<std::vector<double>> ask_list(const std::string& line, double unit) const;
  [[nodiscard]] Status order_line(const std::string& line) const;
  [[nodiscard]] Status order_each(const char* line, std::span<const int> joints) const;
};

}  // namespace nido
