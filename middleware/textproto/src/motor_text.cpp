#include "motor_text.h"

#include <algorithm>
#include <array>

namespace nido {
namespace {

using namespace text_line;  // NOLINT(google-build-using-namespace): of this room

constexpr std::size_t kGains = 10;

// one value alone, and one list alone
Values just(TextValue value) {
  Values values;
  values.push_back(std::move(value));
  return values;
}
Values just_list(Values list) {
  TextValue value{std::move(list)};
  return just(std::move(value));
}
TextValue of(double number) {
  TextValue value{number};
  return value;
}
TextValue of(std::string text) {
  TextValue value{std::move(text)};
  return value;
}
TextValue yes() {
  TextValue value{1LL};
  return value;
}

Outcome<Values> done(const Status& status) {
  if (!status) return refused(status.error());
  return Values{};
}

// -- loops

Values gains_of(const Pid& pid) {
  Values values;
  for (const double gain : {pid.kp, pid.kd, pid.ki, pid.max_integral, pid.max_output, pid.offset, pid.scale,
                            pid.stiction_up, pid.stiction_down, pid.kff}) {
    values.push_back(of(gain));
  }
  return values;
}

std::optional<Pid> gains_from(const TextValue& value) {
  const TextValue::List* list = value.list();
  if (list == nullptr || list->size() != kGains) return std::nullopt;
  std::array<double, kGains> g{};
  for (std::size_t i = 0; i < kGains; ++i) {
    if (!(*list)[i].is_number()) return std::nullopt;
    g[i] = (*list)[i].number();
  }
  return Pid{g[0], g[1], g[2], g[3], g[4], g[5], g[6], g[7], g[8], g[9]};
}

// the word that the loop's numbers are about, and whether it is that of all joints
struct LoopNumber {
  std::string_view one;
  std::string_view all;
  std::vector<double> PidReading::*which;
  bool in_board_units;  // no angles
};
constexpr std::array<LoopNumber, 3> kLoopNumbers = {{{"err", "errs", &PidReading::error, false},
                                                     {"ref", "refs", &PidReading::reference, false},
                                                     {"out", "outs", &PidReading::output, true}}};

std::optional<PidLoop> loop_of(const Values& line) {
  return line.size() > 3 ? pid_loop_from_word(text_of(line, 3)) : std::nullopt;
}

constexpr const char* kPidForm =
    "pid WHAT LOOP J is expected: WHAT pid, err, ref, out, ena, or pids, errs, refs, outs without J; LOOP "
    "pos, vel, trq or cur";

Outcome<Values> get_pid(const IControlBoard& board, const Values& line) {
  const std::optional<PidLoop> loop = loop_of(line);
  if (!loop) return unknown(kPidForm);
  const std::string_view what = text_of(line, 2);
  const bool all = what.ends_with('s');
  const Outcome<std::vector<int>> joints = asked_joints(line, 4, all ? 's' : '\0', board.axes());
  if (const auto* wrong = std::get_if<Refusal>(&joints)) return *wrong;
  Values found;
  if (what == "pid" || what == "pids") {
    const Result<std::vector<Pid>> pids = board.pids(*loop);
    if (!pids) return refused(pids.error());
    for (const int joint : std::get<std::vector<int>>(joints)) {
      found.push_back(just_list(gains_of((*pids)[static_cast<std::size_t>(joint)])).front());
    }
  } else if (what == "ena") {
    const Result<std::vector<Pid>> pids = board.pids(*loop);
    if (!pids) return refused(pids.error());
    found.push_back(yes());
  } else {
    const auto* number = std::find_if(kLoopNumbers.begin(), kLoopNumbers.end(),
                                      [&](const LoopNumber& n) { return n.one == what || n.all == what; });
    if (number == kLoopNumbers.end()) return unknown(kPidForm);
    const Result<PidReading> reading = board.read_pids(*loop);
    if (!reading) return refused(reading.error());
    const bool angles =
        !number->in_board_units && (*loop == PidLoop::kPosition || *loop == PidLoop::kVelocity);
    for (const int joint : std::get<std::vector<int>>(joints)) {
      const double value = ((*reading).*(number->which))[static_cast<std::size_t>(joint)];
      found.push_back(to_value(value, angles ? kDegree_rad : 1.0));
    }
  }
  if (all) return just_list(std::move(found));
  return found;
}

Outcome<Values> set_pid(IControlBoard& board, const Values& line) {
  const std::optional<PidLoop> loop = loop_of(line);
  const std::string_view what = text_of(line, 2);
  if (!loop || (what != "pid" && what != "pids")) {
    return unknown("pid pid LOOP J (10 gains) or pid pids LOOP ((10 gains) ...) is expected");
  }
  Outcome<Targets> which = targets(line, 4, what == "pids" ? 's' : '\0', board.axes(), true);
  if (auto* wrong = std::get_if<Refusal>(&which)) return *wrong;
  std::vector<Pid> pids;
  for (const TextValue& value : std::get<Targets>(which).values) {
    const std::optional<Pid> pid = gains_from(value);
    if (!pid) {
      return unknown(
          "gains are ten numbers: (kp kd ki max_int max_out offset scale stiction_up stiction_down kff)");
    }
    pids.push_back(*pid);
  }
  return done(board.set_pids(*loop, std::get<Targets>(which).joints, pids));
}

// -- interaction

char interaction_suffix(const Values& line) {
  const std::string_view what = text_of(line, 2);
  return what == "mods" ? 's' : what == "modg" ? 'g' : what == "mode" ? '\0' : '?';
}

Outcome<Values> get_interaction(const IControlBoard& board, const Values& line) {
  const char suffix = interaction_suffix(line);
  if (suffix == '?') return unknown("intm mode J, intm mods or intm modg N (J ...) is expected");
  const Outcome<std::vector<int>> joints = asked_joints(line, 3, suffix, board.axes());
  if (const auto* wrong = std::get_if<Refusal>(&joints)) return *wrong;
  const Result<std::vector<InteractionMode>> modes = board.interaction_modes();
  if (!modes) return refused(modes.error());
  Values words;
  for (const int joint : std::get<std::vector<int>>(joints)) {
    words.push_back(word(to_word((*modes)[static_cast<std::size_t>(joint)])));
  }
  if (suffix == '\0') return words;
  return just_list(std::move(words));
}

Outcome<Values> set_interaction(IControlBoard& board, const Values& line) {
  const char suffix = interaction_suffix(line);
  if (suffix == '?') {
    return unknown("intm mode J MODE, intm mods (MODE ...) or intm modg N (J ...) (MODE ...) is expected");
  }
  Outcome<Targets> parsed = targets(line, 3, suffix, board.axes(), true);
  if (auto* wrong = std::get_if<Refusal>(&parsed)) return *wrong;
  const Targets& wanted = std::get<Targets>(parsed);
  std::array<std::vector<int>, 2> joints;  // by mode
  for (std::size_t i = 0; i < wanted.joints.size(); ++i) {
    const bool stiff = wanted.values[i].is_word("stif");
    if (!stiff && !wanted.values[i].is_word("comp")) {
      return Refusal{true, "an interaction mode is stif or comp"};
    }
    joints[stiff ? 0 : 1].push_back(wanted.joints[i]);
  }
  // what may be refused comes first, so that nothing has changed then
  if (Status set = board.set_interaction_mode(joints[1], InteractionMode::kCompliant); !set) {
    return refused(set.error());
  }
  return done(board.set_interaction_mode(joints[0], InteractionMode::kStiff));
}

Outcome<Values> get_impedance(const IControlBoard& board, const Values& line) {
  const std::string_view what = text_of(line, 2);
  if (what != "ipr" && what != "iof") return unknown("iimp ipr J or iimp iof J is expected");
  const Outcome<std::vector<int>> joints = asked_joints(line, 3, '\0', board.axes());
  if (const auto* wrong = std::get_if<Refusal>(&joints)) return *wrong;
  const Result<std::vector<Impedance>> all = board.impedances();
  if (!all) return refused(all.error());
  const Impedance& one = (*all)[static_cast<std::size_t>(std::get<std::vector<int>>(joints).front())];
  // N m per degree: what is divided by an angle is smaller there
  if (what == "iof") return just_list(just(of(one.offset_Nm)));
  Values pair = just(to_value(one.stiffness_Nm_rad, 1 / kDegree_rad));
  pair.push_back(to_value(one.damping_Nms_rad, 1 / kDegree_rad));
  return just_list(std::move(pair));
}

Outcome<Values> set_impedance(IControlBoard& board, const Values& line) {
  const std::string_view what = text_of(line, 2);
  if (what != "ipr" && what != "iof") {
    return unknown("iimp ipr J (STIFFNESS DAMPING) or iimp iof J (OFFSET) is expected");
  }
  Outcome<Targets> which = targets(line, 3, '\0', board.axes(), true);
  if (auto* wrong = std::get_if<Refusal>(&which)) return *wrong;
  const TextValue::List* list = std::get<Targets>(which).values.front().list();
  if (list == nullptr || list->size() != (what == "ipr" ? 2U : 1U)) {
    return unknown("ipr has (STIFFNESS DAMPING), iof has (OFFSET)");
  }
  Outcome<std::vector<double>> given = numbers(*list, 1.0);
  if (auto* wrong = std::get_if<Refusal>(&given)) return *wrong;
  const std::vector<double>& values = std::get<std::vector<double>>(given);
  const Result<std::vector<Impedance>> all = board.impedances();
  if (!all) return refused(all.error());
  const std::vector<int>& joints = std::get<Targets>(which).joints;
  Impedance one = (*all)[static_cast<std::size_t>(joints.front())];
  if (what == "ipr") {
    one.stiffness_Nm_rad = values[0] / kDegree_rad;
    one.damping_Nms_rad = values[1] / kDegree_rad;
  } else {
    one.offset_Nm = values[0];
  }
  return done(board.set_impedances(joints, {&one, 1}));
}

// -- variables

Outcome<Values> get_variable(const IControlBoard& board, const Values& line) {
  if (text_of(line, 2) == "lvar" && line.size() == 3) {
    const Result<std::vector<std::string>> names = board.variable_names();
    if (!names) return refused(names.error());
    Values list;
    for (const std::string& name : *names) list.push_back(of(name));
    return just_list(std::move(list));
  }
  if (text_of(line, 2) != "mvar" || line.size() != 4 || line[3].text() == nullptr) {
    return unknown("ivar lvar or ivar mvar NAME is expected");
  }
  const Result<std::string> value = board.variable(*line[3].text());
  if (!value) return refused(value.error());
  // a list is kept as its text
  if (value->starts_with('(')) {
    if (Result<Values> list = parse_text(*value)) return just_list(std::move(*list));
  }
  return just_list(just(of(*value)));
}

Outcome<Values> set_variable(IControlBoard& board, const Values& line) {
  if (text_of(line, 2) != "mvar" || line.size() < 5 || line[3].text() == nullptr) {
    return unknown("ivar mvar NAME VALUE is expected");
  }
  const std::string value = line.size() == 5 && line[4].text() != nullptr
                                ? *line[4].text()
                                : format_text(Values(line.begin() + 4, line.end()));
  return done(board.set_variable(*line[3].text(), value));
}

// -- faults

// number and sentence of what is wrong with a joint
Outcome<Values> get_fault(const IControlBoard& board, const Values& line) {
  if (text_of(line, 2) != "jhfl") return unknown("ijfl jhfl J is expected");
  const Outcome<std::vector<int>> joints = asked_joints(line, 3, '\0', board.axes());
  if (const auto* wrong = std::get_if<Refusal>(&joints)) return *wrong;
  const Result<std::vector<ControlMode>> modes = board.control_modes();
  if (!modes) return refused(modes.error());
  const auto joint = static_cast<std::size_t>(std::get<std::vector<int>>(joints).front());
  const bool broken = (*modes)[joint] == ControlMode::kFault;
  Values values = just({broken ? 1LL : 0LL});
  values.push_back(of(std::string(broken ? "the hardware has failed" : "")));
  return values;
}

// -- calibration

Outcome<Values> set_calibration(IControlBoard& board, const Values& line) {
  const std::string_view what = text_of(line, 2);
  if (what == "quca" || what == "qupa") return Values{};
  const bool all = what.ends_with('s');
  const std::string_view stem = what.substr(0, what.size() - (all ? 1 : 0));
  if (stem != "cal" && stem != "hom" && stem != "par") {
    return unknown("reca cal J, reca hom J, reca par J, or cals, homs, pars for all joints, is expected");
  }
  Outcome<Targets> which = targets(line, 3, all ? 's' : '\0', board.axes(), false);
  if (auto* wrong = std::get_if<Refusal>(&which)) return *wrong;
  const std::vector<int>& joints = std::get<Targets>(which).joints;
  return done(stem == "cal" ? board.calibrate(joints) : board.home(joints));
}

}  // namespace

std::optional<Outcome<Values>> get_motors(const IControlBoard& board, const Values& line) {
  const std::string_view what = text_of(line, 1);
  if (what == "pid") return get_pid(board, line);
  if (what == "intm") return get_interaction(board, line);
  if (what == "iimp") return get_impedance(board, line);
  if (what == "ivar") return get_variable(board, line);
  if (what == "reca" && text_of(line, 2) == "isca") return just(yes());
  if (what == "ijfl") return get_fault(board, line);
  return std::nullopt;
}

std::optional<Outcome<Values>> set_motors(IControlBoard& board, const Values& line) {
  const std::string_view what = text_of(line, 1);
  if (what == "pid") return set_pid(board, line);
  if (what == "intm") return set_interaction(board, line);
  if (what == "iimp") return set_impedance(board, line);
  if (what == "ivar") return set_variable(board, line);
  if (what == "reca") return set_calibration(board, line);
  return std::nullopt;
}

std::optional<Outcome<Values>> order_motors(IControlBoard& board, const Values& line) {
  const std::string_view what = text_of(line, 0);
  if (line.size() < 2) return std::nullopt;
  if (what == "park") return done(board.home(all_joints(board.axes())));
  if (what != "calj" && what != "cald" && what != "cal") return std::nullopt;
  const std::optional<int> joint = whole_number(line[1]);
  if (!joint) return unknown("a joint is a whole number");
  const int joints[] = {*joint};
  if (Status valid = check_joints(board.axes(), joints); !valid) return refused(valid.error());
  if (what != "cald") return done(board.calibrate(joints));
  const Result<std::vector<bool>> calibrated = board.calibrated();
  if (!calibrated) return refused(calibrated.error());
  if (!(*calibrated)[static_cast<std::size_t>(*joint)]) {
    return Refusal{true, fmt::format("joint {} is not calibrated", *joint)};
  }
  return Values{};
}

bool tells_no_time(const Values& line) {
  const std::string_view what = text_of(line, 1);
  return what == "pid" || what == "ipwm" || what == "icur" || what == "ivar" || what == "reca" ||
         what == "ijfl";
}

}  // namespace nido
