#include "nido/textproto/asked_board.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "line.h"
#include "nido/interfaces/check_motors.h"

namespace nido {
namespace {

using namespace text_line;  // NOLINT(google-build-using-namespace): of this room

Error strange(const std::string& line) {
  return {ErrorCode::kFailed, fmt::format("the answer to '{}' is not understood", line)};
}

// the first list of an answer, wherever the words before it end
const TextValue::List* first_list(const Values& words) {
  for (const TextValue& value : words) {
    if (value.list() != nullptr) return value.list();
  }
  return nullptr;
}

std::string gains(const Pid& p) {
  std::string out = "(";
  for (const double gain : {p.kp, p.kd, p.ki, p.max_integral, p.max_output, p.offset, p.scale, p.stiction_up,
                            p.stiction_down, p.kff}) {
    out += (out.size() > 1 ? " " : "") + format_number(gain);
  }
  return out + ")";
}

}  // namespace

Result<std::vector<double>> AskedBoard::ask_list(const std::string& line, double unit) const {
  const Result<Values> words = ask_line(line);
  if (!words) return words.error();
  const TextValue::List* list = first_list(*words);
  if (list == nullptr || list->size() != static_cast<std::size_t>(axes())) return strange(line);
  std::vector<double> numbers;
  for (const TextValue& value : *list) {
    if (!value.is_number()) return strange(line);
    numbers.push_back(value.number() * unit);
  }
  return numbers;
}

Status AskedBoard::order_line(const std::string& line) const {
  const Result<Values> words = ask_line(line);
  return words ? Status() : Status(words.error());
}

Status AskedBoard::order_each(const char* line, std::span<const int> joints) const {
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  for (const int joint : joints) {
    if (Status ordered = order_line(fmt::format("{} {}", line, joint)); !ordered) return ordered;
  }
  return {};
}

Result<MotorReading> AskedBoard::read_motors() const {
  MotorReading reading;
  Result<std::vector<double>> position = ask_list("get mncs", kDegree_rad);
  if (!position) return position.error();
  const Result<JointReading> joints = read_joints();
  reading.stamp_ns = joints ? joints->stamp_ns : 0;
  reading.position_rad = std::move(*position);
  // the rest is not measured everywhere
  const auto take = [&](const char* line, double unit, std::vector<double>& into) {
    if (Result<std::vector<double>> got = ask_list(line, unit)) into = std::move(*got);
  };
  take("get msps", kDegree_rad, reading.velocity_rad_s);
  take("get macs", kDegree_rad, reading.acceleration_rad_s2);
  take("get ipwm pwms", kPercent, reading.duty_cycle);
  take("get acus", 1.0, reading.current_A);
  take("get tmps", 1.0, reading.temperature_C);
  return reading;
}

Result<std::vector<bool>> AskedBoard::amplifiers_on() const {
  const Result<std::vector<double>> numbers = ask_list("get asta", 1.0);
  if (!numbers) return numbers.error();
  std::vector<bool> on;
  for (const double number : *numbers) on.push_back(number != 0);
  return on;
}

Result<std::vector<Pid>> AskedBoard::pids(PidLoop loop) const {
  const std::string line = fmt::format("get pid pids {}", to_word(loop));
  const Result<Values> words = ask_line(line);
  if (!words) return words.error();
  const TextValue::List* list = first_list(*words);
  if (list == nullptr || list->size() != static_cast<std::size_t>(axes())) return strange(line);
  std::vector<Pid> all;
  for (const TextValue& entry : *list) {
    const TextValue::List* g = entry.list();
    if (g == nullptr || g->size() != 10) return strange(line);
    std::array<double, 10> n{};
    for (std::size_t i = 0; i < n.size(); ++i) {
      if (!(*g)[i].is_number()) return strange(line);
      n[i] = (*g)[i].number();
    }
    all.push_back({n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8], n[9]});
  }
  return all;
}

Status AskedBoard::set_pids(PidLoop loop, std::span<const int> joints, std::span<const Pid> pids) {
  if (Status valid = check_pids(axes(), joints, pids); !valid) return valid;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (Status set =
            order_line(fmt::format("set pid pid {} {} {}", to_word(loop), joints[i], gains(pids[i])));
        !set) {
      return set;
    }
  }
  return {};
}

Result<PidReading> AskedBoard::read_pids(PidLoop loop) const {
  const double unit = loop == PidLoop::kPosition || loop == PidLoop::kVelocity ? kDegree_rad : 1.0;
  Result<std::vector<double>> reference = ask_list(fmt::format("get pid refs {}", to_word(loop)), unit);
  if (!reference) return reference.error();
  Result<std::vector<double>> error = ask_list(fmt::format("get pid errs {}", to_word(loop)), unit);
  if (!error) return error.error();
  Result<std::vector<double>> output = ask_list(fmt::format("get pid outs {}", to_word(loop)), 1.0);
  if (!output) return output.error();
  return PidReading{std::move(*reference), std::move(*error), std::move(*output)};
}

Result<std::vector<InteractionMode>> AskedBoard::interaction_modes() const {
  const std::string line = "get intm mods";
  const Result<Values> words = ask_line(line);
  if (!words) return words.error();
  const TextValue::List* list = first_list(*words);
  if (list == nullptr || list->size() != static_cast<std::size_t>(axes())) return strange(line);
  std::vector<InteractionMode> modes;
  for (const TextValue& value : *list) {
    modes.push_back(value.is_word("comp") ? InteractionMode::kCompliant : InteractionMode::kStiff);
  }
  return modes;
}

Status AskedBoard::set_interaction_mode(std::span<const int> joints, InteractionMode mode) {
  if (Status valid = check_joints(axes(), joints); !valid) return valid;
  if (joints.empty()) return {};
  const std::vector<std::string_view> words(joints.size(), to_word(mode));
  return order_line(fmt::format("set intm modg {} ({}) ({})", joints.size(), fmt::join(joints, " "),
                                fmt::join(words, " ")));
}

Result<std::vector<Impedance>> AskedBoard::impedances() const {
  std::vector<Impedance> all;
  for (int joint = 0; joint < axes(); ++joint) {
    Impedance one;
    for (const bool offset : {false, true}) {
      const std::string line = fmt::format("get iimp {} {}", offset ? "iof" : "ipr", joint);
      const Result<Values> words = ask_line(line);
      if (!words) return words.error();
      const TextValue::List* list = first_list(*words);
      if (list == nullptr || list->size() != (offset ? 1U : 2U) || !list->front().is_number() ||
          !list->back().is_number()) {
        return strange(line);
      }
      if (offset) {
        one.offset_Nm = list->front().number();
      } else {
        one.stiffness_Nm_rad = list->front().number() / kDegree_rad;
        one.damping_Nms_rad = list->back().number() / kDegree_rad;
      }
    }
    all.push_back(one);
  }
  return all;
}

Status AskedBoard::set_impedances(std::span<const int> joints, std::span<const Impedance> impedances) {
  if (Status valid = check_impedances(axes(), joints, impedances); !valid) return valid;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const Impedance& one = impedances[i];
    if (Status set = order_line(fmt::format("set iimp ipr {} ({} {})", joints[i],
                                            format_number(one.stiffness_Nm_rad * kDegree_rad),
                                            format_number(one.damping_Nms_rad * kDegree_rad)));
        !set) {
      return set;
    }
    if (Status set = order_line(fmt::format("set iimp iof {} ({})", joints[i], format_number(one.offset_Nm)));
        !set) {
      return set;
    }
  }
  return {};
}

Status AskedBoard::calibrate(std::span<const int> joints) { return order_each("set reca cal", joints); }
Status AskedBoard::home(std::span<const int> joints) { return order_each("set reca hom", joints); }

Result<std::vector<bool>> AskedBoard::calibrated() const {
  std::vector<bool> all;
  for (int joint = 0; joint < axes(); ++joint) {
    const Status told = order_line(fmt::format("cald {}", joint));
    if (!told && told.error().code != ErrorCode::kFailed) return told.error();
    all.push_back(told.ok());
  }
  return all;
}

Result<std::vector<std::string>> AskedBoard::variable_names() const {
  const std::string line = "get ivar lvar";
  const Result<Values> words = ask_line(line);
  if (!words) return words.error();
  const TextValue::List* list = first_list(*words);
  if (list == nullptr) return strange(line);
  std::vector<std::string> names;
  for (const TextValue& value : *list) {
    if (value.text() == nullptr) return strange(line);
    names.push_back(*value.text());
  }
  return names;
}

Result<std::string> AskedBoard::variable(const std::string& name) const {
  const std::string line = "get ivar mvar " + format_text({{name}});
  const Result<Values> words = ask_line(line);
  if (!words) return words.error();
  const TextValue::List* list = first_list(*words);
  if (list == nullptr) return strange(line);
  if (list->size() == 1 && list->front().text() != nullptr) return *list->front().text();
  return format_text(*list);
}

Status AskedBoard::set_variable(const std::string& name, const std::string& value) {
  return order_line("set ivar mvar " + format_text({{name}, {value}}));
}

}  // namespace nido
