#include "nido/textproto/control_board_text.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "nido/interfaces/check_joints.h"
#include "nido/textproto/text_value.h"

namespace nido {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180.0;
constexpr double kPercent = 0.01;

using Values = std::vector<TextValue>;

constexpr std::array<std::pair<std::string_view, ControlMode>, 7> kModeWords = {
    {{"idl", ControlMode::kIdle},
     {"pos", ControlMode::kPosition},
     {"posd", ControlMode::kDirect},
     {"vel", ControlMode::kVelocity},
     {"torq", ControlMode::kTorque},
     {"ipwm", ControlMode::kPwm},
     {"hwfa", ControlMode::kFault}}};

TextValue word(std::string_view text) { return {TextValue::Word{std::string(text), true}}; }

// what a line could not do, and whether it was understood
struct Refusal {
  bool understood = true;
  std::string sentence;
};
Refusal refused(const Error& error) { return {true, error.message}; }
Refusal unknown(std::string sentence) { return {false, std::move(sentence)}; }

template <class T>
using Outcome = std::variant<T, Refusal>;

// -- reading a line
// ---------------------------------------------------------------------------------------------------

// the joints that a line names, and what it gives to each
struct Targets {
  std::vector<int> joints;
  Values values;
};

std::optional<int> whole_number(const TextValue& value) {
  const auto* whole = std::get_if<long long>(&value.content);
  if (whole == nullptr || *whole < -1'000'000 || *whole > 1'000'000) return std::nullopt;
  return static_cast<int>(*whole);
}

Outcome<std::vector<int>> joint_list(const TextValue& value) {
  std::vector<int> joints;
  if (value.list() == nullptr) return unknown("a list of joints in parentheses is expected");
  for (const TextValue& item : *value.list()) {
    const std::optional<int> joint = whole_number(item);
    if (!joint) return unknown("a joint is a whole number");
    joints.push_back(*joint);
  }
  return joints;
}

// suffix of a word: "" one joint `J V`, 's' all joints `(V ...)`, 'g' a group `N (J ...) (V ...)`
Outcome<Targets> targets(const Values& line, std::size_t first, char suffix, int axes, bool with_values) {
  const std::size_t given = line.size() - first;
  Targets out;
  if (suffix == 's') {
    if (given != (with_values ? 1U : 0U) || (with_values && line[first].list() == nullptr)) {
      return unknown(with_values ? fmt::format("a list of {} values in parentheses is expected", axes)
                                 : std::string("nothing more is expected"));
    }
    out.joints = all_joints(axes);
    if (with_values) out.values = *line[first].list();
  } else if (suffix == 'g') {
    if (given != (with_values ? 3U : 2U) || (with_values && line[first + 2].list() == nullptr)) {
      return unknown(with_values ? "N (JOINT ...) (VALUE ...) is expected" : "N (JOINT ...) is expected");
    }
    Outcome<std::vector<int>> joints = joint_list(line[first + 1]);
    if (auto* wrong = std::get_if<Refusal>(&joints)) return *wrong;
    out.joints = std::get<std::vector<int>>(std::move(joints));
    if (whole_number(line[first]) != static_cast<int>(out.joints.size())) {
      return Refusal{true,
                     fmt::format("the count does not fit the {} joints of the list", out.joints.size())};
    }
    if (with_values) out.values = *line[first + 2].list();
  } else {
    if (given != (with_values ? 2U : 1U))
      return unknown(with_values ? "JOINT VALUE is expected" : "JOINT is expected");
    const std::optional<int> joint = whole_number(line[first]);
    if (!joint) return unknown("a joint is a whole number");
    out.joints = {*joint};
    if (with_values) out.values = {line[first + 1]};
  }
  if (const Status valid = check_joints(axes, out.joints); !valid) return refused(valid.error());
  if (with_values && out.values.size() != out.joints.size()) {
    return Refusal{true, fmt::format("{} joints but {} values: one a joint is expected", out.joints.size(),
                                     out.values.size())};
  }
  return out;
}

Outcome<std::vector<double>> numbers(const Values& values, double unit) {
  std::vector<double> out;
  for (const TextValue& value : values) {
    if (!value.is_number()) return unknown("a value is a number");
    out.push_back(value.number() * unit);
  }
  return out;
}

Outcome<ControlMode> mode_of(const TextValue& value) {
  const std::optional<ControlMode> mode =
      value.text() != nullptr ? mode_from_word(*value.text()) : std::nullopt;
  if (!mode) return unknown("a mode is one of idl, pos, posd, vel, torq, ipwm");
  return *mode;
}

// -- get
// --------------------------------------------------------------------------------------------------------------

// a number of each joint
struct Quantity {
  std::string_view one;  // word for one joint
  std::string_view all;  // word for all joints
  double unit;           // of the number on this side, in SI
  Result<std::vector<double>> (*read)(const IControlBoard&);
};

template <auto member>
Result<std::vector<double>> from_reading(const IControlBoard& board) {
  Result<JointReading> reading = board.read_joints();
  if (!reading) return reading.error();
  return (*reading).*member;
}

Result<std::vector<double>> motion_done_numbers(const IControlBoard& board) {
  const Result<std::vector<bool>> done = board.motion_done();
  if (!done) return done.error();
  return std::vector<double>(done->begin(), done->end());
}

constexpr double kCount = 0;  // unit of whole numbers

constexpr std::array<Quantity, 7> kQuantities = {{
    {"enc", "encs", kDegree_rad, &from_reading<&JointReading::position_rad>},
    {"esp", "esps", kDegree_rad, &from_reading<&JointReading::velocity_rad_s>},
    {"eac", "eacs", kDegree_rad, &from_reading<&JointReading::acceleration_rad_s2>},
    {"pos", "poss", kDegree_rad, [](const IControlBoard& b) { return b.target_positions(); }},
    {"vel", "vels", kDegree_rad, [](const IControlBoard& b) { return b.reference_speeds(); }},
    {"acc", "accs", kDegree_rad, [](const IControlBoard& b) { return b.reference_accelerations(); }},
    {"don", "dons", kCount, &motion_done_numbers},
}};
constexpr Quantity kTorque = {"trq", "trqs", 1.0, &from_reading<&JointReading::torque_Nm>};

TextValue to_value(double si, double unit) {
  if (unit == kCount) return {static_cast<long long>(si)};
  // a target of 30.5 degrees reads back as 30.5: the two conversions leave an error in the last digits
  constexpr double kDigits = 1e10;
  return {std::round(si / unit * kDigits) / kDigits};
}

Outcome<Values> get_quantity(const IControlBoard& board, const Quantity& quantity, const Values& line,
                             std::size_t at_word) {
  const bool all = line[at_word].is_word(quantity.all);
  Outcome<Targets> which = targets(line, at_word + 1, all ? 's' : '\0', board.axes(), false);
  if (auto* wrong = std::get_if<Refusal>(&which)) return *wrong;
  const Result<std::vector<double>> read = quantity.read(board);
  if (!read) return refused(read.error());
  Values found;
  for (const int joint : std::get<Targets>(which).joints) {
    found.push_back(to_value((*read)[static_cast<std::size_t>(joint)], quantity.unit));
  }
  if (all) return Values{{std::move(found)}};
  return found;
}

Outcome<Values> get_modes(const IControlBoard& board, const Values& line) {
  if (line.size() < 3) return unknown("icmd cmod J, icmd cmds or icmd cmog N (J ...) is expected");
  const char suffix = line[2].is_word("cmds") ? 's' : line[2].is_word("cmog") ? 'g' : '\0';
  if (suffix == '\0' && !line[2].is_word("cmod")) return unknown("icmd knows cmod, cmds and cmog");
  Outcome<Targets> which = targets(line, 3, suffix, board.axes(), false);
  if (auto* wrong = std::get_if<Refusal>(&which)) return *wrong;
  const Result<std::vector<ControlMode>> modes = board.control_modes();
  if (!modes) return refused(modes.error());
  Values words;
  for (const int joint : std::get<Targets>(which).joints) {
    words.push_back(word(mode_word((*modes)[static_cast<std::size_t>(joint)])));
  }
  if (suffix == '\0')
    return Values{{static_cast<long long>(std::get<Targets>(which).joints.front())}, words.front()};
  return Values{{std::move(words)}};
}

Outcome<Values> get_limits(const IControlBoard& board, const Values& line, std::size_t first,
                           const std::string& what) {
  Outcome<Targets> which = targets(line, first, '\0', board.axes(), false);
  if (auto* wrong = std::get_if<Refusal>(&which)) return *wrong;
  const Result<std::vector<JointLimits>> limits = board.limits();
  if (!limits) return refused(limits.error());
  const JointLimits& joint = (*limits)[static_cast<std::size_t>(std::get<Targets>(which).joints.front())];
  if (what == "llim")
    return Values{to_value(joint.min_rad, kDegree_rad), to_value(joint.max_rad, kDegree_rad)};
  if (what == "vlim") return Values{{0.0}, to_value(joint.max_velocity_rad_s, kDegree_rad)};
  return Values{{-joint.max_torque_Nm}, {joint.max_torque_Nm}};
}

// name, limits and greatest torque of all joints in one answer
Outcome<Values> get_info(const IControlBoard& board) {
  const Result<std::vector<JointLimits>> limits = board.limits();
  if (!limits) return refused(limits.error());
  Values joints;
  for (int joint = 0; joint < board.axes(); ++joint) {
    Result<std::string> name = board.axis_name(joint);
    if (!name) return refused(name.error());
    const JointLimits& of_joint = (*limits)[static_cast<std::size_t>(joint)];
    joints.push_back({Values{{TextValue::Word{std::move(*name), false}},
                             {of_joint.min_rad / kDegree_rad},
                             {of_joint.max_rad / kDegree_rad},
                             {of_joint.max_velocity_rad_s / kDegree_rad},
                             {of_joint.max_torque_Nm}}});
  }
  return Values{{std::move(joints)}};
}

Outcome<Values> get(const IControlBoard& board, const Values& line) {
  if (line.size() == 2 && line[1].is_word("info")) return get_info(board);
  for (const Quantity& quantity : kQuantities) {
    if (line[1].is_word(quantity.one) || line[1].is_word(quantity.all))
      return get_quantity(board, quantity, line, 1);
  }
  if (line[1].is_word("axes")) return Values{{static_cast<long long>(board.axes())}};
  if (line[1].is_word("prot")) return Values{{1LL}, {9LL}, {0LL}};
  if (line[1].is_word("llim") || line[1].is_word("vlim")) return get_limits(board, line, 2, *line[1].text());
  if (line[1].is_word("icmd")) return get_modes(board, line);
  if (line[1].is_word("torq")) {
    if (line.size() >= 3 && (line[2].is_word("trq") || line[2].is_word("trqs"))) {
      return get_quantity(board, kTorque, line, 2);
    }
    if (line.size() >= 3 && line[2].is_word("rng")) return get_limits(board, line, 3, "rng");
    return unknown("torq knows trq J, trqs and rng J");
  }
  if (line[1].is_word("name") || line[1].is_word("type")) {
    Outcome<Targets> which = targets(line, 2, '\0', board.axes(), false);
    if (auto* wrong = std::get_if<Refusal>(&which)) return *wrong;
    if (line[1].is_word("type")) return Values{{0LL}};  // all joints turn
    Result<std::string> name = board.axis_name(std::get<Targets>(which).joints.front());
    if (!name) return refused(name.error());
    return Values{{TextValue::Word{std::move(*name), false}}};
  }
  return unknown("this cannot be got");
}

// -- set
// --------------------------------------------------------------------------------------------------------------

// a command with a number for each joint
struct Command {
  std::string_view stem;   // one joint
  std::string_view all;    // all joints
  std::string_view group;  // some joints
  double unit;
  Status (*send)(IControlBoard&, std::span<const int>, std::span<const double>);
};

Status move_by(IControlBoard& board, std::span<const int> joints, std::span<const double> by_rad) {
  const Result<JointReading> reading = board.read_joints();
  if (!reading) return reading.error();
  std::vector<double> target_rad(by_rad.begin(), by_rad.end());
  for (std::size_t i = 0; i < joints.size(); ++i) {
    target_rad[i] += reading->position_rad[static_cast<std::size_t>(joints[i])];
  }
  return board.move_to(joints, target_rad);
}

using Joints = std::span<const int>;
using Numbers = std::span<const double>;

constexpr std::array<Command, 6> kCommands = {{
    {"pos", "poss", "posg", kDegree_rad,
     [](IControlBoard& b, Joints j, Numbers v) { return b.move_to(j, v); }},
    {"rel", "rels", "relg", kDegree_rad, &move_by},
    {"vel", "vels", "velg", kDegree_rad,
     [](IControlBoard& b, Joints j, Numbers v) { return b.set_reference_speeds(j, v); }},
    {"acc", "accs", "accg", kDegree_rad,
     [](IControlBoard& b, Joints j, Numbers v) { return b.set_reference_accelerations(j, v); }},
    {"vmo", "vmos", "vmog", kDegree_rad,
     [](IControlBoard& b, Joints j, Numbers v) { return b.set_velocities(j, v); }},
    {"dpo", "dpos", "dpog", kDegree_rad,
     [](IControlBoard& b, Joints j, Numbers v) { return b.set_positions(j, v); }},
}};
constexpr Command kTorqueCommand = {
    "ref", "refs", "refg", 1.0, [](IControlBoard& b, Joints j, Numbers v) { return b.set_torques(j, v); }};
constexpr Command kPwmCommand = {"ref", "refs", "refg", kPercent, [](IControlBoard& b, Joints j, Numbers v) {
                                   return b.set_duty_cycles(j, v);
                                 }};

// 's', 'g', nothing, or no value when the word is none of the command's
std::optional<char> form(const Command& command, const TextValue& value) {
  if (value.is_word(command.stem)) return '\0';
  if (value.is_word(command.all)) return 's';
  if (value.is_word(command.group)) return 'g';
  return std::nullopt;
}

Outcome<Values> send(IControlBoard& board, const Command& command, char suffix, const Values& line,
                     std::size_t first) {
  Outcome<Targets> parsed = targets(line, first, suffix, board.axes(), true);
  if (auto* wrong = std::get_if<Refusal>(&parsed)) return *wrong;
  const Targets& wanted = std::get<Targets>(parsed);
  Outcome<std::vector<double>> values = numbers(wanted.values, command.unit);
  if (auto* wrong = std::get_if<Refusal>(&values)) return *wrong;
  const Status sent = command.send(board, wanted.joints, std::get<std::vector<double>>(values));
  if (!sent) return refused(sent.error());
  return Values{};
}

Outcome<Values> set_modes(IControlBoard& board, const Values& line) {
  if (line.size() < 3)
    return unknown("icmd cmod J MODE, icmd cmds (MODE ...) or icmd cmog N (J ...) (MODE ...) is expected");
  const char suffix = line[2].is_word("cmds") ? 's' : line[2].is_word("cmog") ? 'g' : '\0';
  if (suffix == '\0' && !line[2].is_word("cmod")) return unknown("icmd knows cmod, cmds and cmog");
  Outcome<Targets> parsed = targets(line, 3, suffix, board.axes(), true);
  if (auto* wrong = std::get_if<Refusal>(&parsed)) return *wrong;
  const Targets& wanted = std::get<Targets>(parsed);
  // all modes are read before the first is set
  std::vector<ControlMode> modes;
  for (const TextValue& value : wanted.values) {
    Outcome<ControlMode> mode = mode_of(value);
    if (auto* wrong = std::get_if<Refusal>(&mode)) return *wrong;
    if (std::get<ControlMode>(mode) == ControlMode::kFault)
      return Refusal{true, "mode hwfa cannot be asked for"};
    modes.push_back(std::get<ControlMode>(mode));
  }
  for (const auto& [text, mode] : kModeWords) {
    std::vector<int> joints;
    for (std::size_t i = 0; i < modes.size(); ++i) {
      if (modes[i] == mode) joints.push_back(wanted.joints[i]);
    }
    if (joints.empty()) continue;
    if (const Status set = board.set_control_mode(joints, mode); !set) return refused(set.error());
  }
  return Values{};
}

Outcome<Values> stop(IControlBoard& board, const Values& line, char suffix) {
  Outcome<Targets> which = targets(line, 2, suffix, board.axes(), false);
  if (auto* wrong = std::get_if<Refusal>(&which)) return *wrong;
  const Status stopped = board.stop(std::get<Targets>(which).joints);
  if (!stopped) return refused(stopped.error());
  return Values{};
}

Outcome<Values> set(IControlBoard& board, const Values& line) {
  for (const Command& command : kCommands) {
    if (const std::optional<char> suffix = form(command, line[1]))
      return send(board, command, *suffix, line, 2);
  }
  if (line[1].is_word("sto")) return stop(board, line, '\0');
  if (line[1].is_word("stos")) return stop(board, line, 's');
  if (line[1].is_word("stog")) return stop(board, line, 'g');
  if (line[1].is_word("icmd")) return set_modes(board, line);
  if (line[1].is_word("torq") || line[1].is_word("ipwm")) {
    const Command& command = line[1].is_word("torq") ? kTorqueCommand : kPwmCommand;
    const std::optional<char> suffix = line.size() > 2 ? form(command, line[2]) : std::nullopt;
    if (suffix) return send(board, command, *suffix, line, 3);
    return unknown("ref J V, refs (V ...) or refg N (J ...) (V ...) is expected");
  }
  return unknown("this cannot be set");
}

std::string refusal_text(const Refusal& refusal) {
  return format_text({word(refusal.understood ? "fail" : "nak"), {refusal.sentence}});
}

}  // namespace

std::string mode_word(ControlMode mode) {
  for (const auto& [text, known] : kModeWords) {
    if (known == mode) return std::string(text);
  }
  return "unkw";
}

std::optional<ControlMode> mode_from_word(std::string_view text) {
  for (const auto& [known, mode] : kModeWords) {
    if (known == text) return mode;
  }
  return std::nullopt;
}

const std::string& ControlBoardText::help() {
  static const std::string text =
      "get axes | get info | get encs|esps|eacs|poss|vels|accs|dons | get enc|esp|eac|pos|vel|acc|don J | "
      "get "
      "llim|vlim|name|type J"
      " | get icmd cmod J | get icmd cmds | get torq trqs | get torq trq|rng J | get prot"
      " | set pos|rel|vel|acc|vmo|dpo J V | set poss|rels|vels|accs|vmos|dpos (V ...)"
      " | set posg|relg|velg|accg|vmog|dpog N (J ...) (V ...) | set sto J | set stos | set stog N (J ...)"
      " | set icmd cmod J MODE | set icmd cmds (MODE ...) | set torq|ipwm ref J V"
      " | MODE: idl pos posd vel torq ipwm | degrees, deg/s, N m, percent";
  return text;
}

std::string ControlBoardText::reply(const std::string& line) {
  Result<std::vector<TextValue>> parsed = parse_text(line);
  if (!parsed) return refusal_text(unknown(parsed.error().message));
  const Values& words = *parsed;
  if (words.size() == 1 && words[0].is_word("help")) return format_text({word("ok"), {help()}});
  const bool is_get = !words.empty() && words[0].is_word("get");
  const bool is_set = !words.empty() && words[0].is_word("set");
  if (words.size() < 2 || (!is_get && !is_set)) {
    return refusal_text(unknown("a line begins with 'get WHAT' or 'set WHAT'; 'help' tells more"));
  }
  Outcome<Values> outcome = is_get ? get(board_, words) : set(board_, words);
  if (auto* wrong = std::get_if<Refusal>(&outcome)) {
    constexpr std::size_t kQuoted = 80;  // characters of the line that are repeated
    if (!wrong->understood)
      wrong->sentence = fmt::format("'{}': {}", line.substr(0, kQuoted), wrong->sentence);
    return refusal_text(*wrong);
  }
  if (is_set) return "[ok]";
  // [is] WHAT values [tsta] count time [ok], with WHAT as it was asked
  Values answer = {word("is"), words[1]};
  const bool is_nested = words[1].is_word("icmd") || words[1].is_word("torq");
  if (is_nested) answer[1] = words[2];
  for (TextValue& value : std::get<Values>(outcome)) answer.push_back(std::move(value));
  if (!words[1].is_word("prot") && !words[1].is_word("axes")) {
    const Result<JointReading> reading = board_.read_joints();
    answer.push_back(word("tsta"));
    answer.push_back({static_cast<long long>(count_.fetch_add(1))});
    answer.push_back({reading ? static_cast<double>(reading->stamp_ns) * 1e-9 : 0.0});
  }
  answer.push_back(word("ok"));
  return format_text(answer);
}

}  // namespace nido
