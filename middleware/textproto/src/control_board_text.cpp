#include "nido/textproto/control_board_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "line.h"
#include "motor_text.h"
#include "nearest_of.h"
#include "nido/interfaces/board_extras.h"
#include "nido/interfaces/check_joints.h"
#include "nido/textproto/text_value.h"
#include "quantities.h"

namespace nido {
namespace {

constexpr long long kTurningJoint = 'a' | 't' << 8 | 'r' << 16 | 'v' << 24;  // YARP's number of the word atrv

using namespace text_line;  // NOLINT(google-build-using-namespace): of this room

constexpr std::array<std::pair<std::string_view, ControlMode>, 7> kModeWords = {
    {{"idl", ControlMode::kIdle},
     {"pos", ControlMode::kPosition},
     {"posd", ControlMode::kDirect},
     {"vel", ControlMode::kVelocity},
     {"torq", ControlMode::kTorque},
     {"ipwm", ControlMode::kPwm},
     {"hwfa", ControlMode::kFault}}};

constexpr std::array kGetWords = std::to_array<std::string_view>(
    {"encs", "enc",  "esps", "esp",  "eacs", "eac",  "poss", "pos",  "posg", "vels", "vel",  "velg",
     "accs", "acc",  "accg", "dons", "don",  "dong", "donl", "icmd", "torq", "llim", "vlim", "axes",
     "name", "type", "prot", "info", "mncs", "mnc",  "msps", "msp",  "macs", "mac",  "mnum", "mtnm",
     "dpos", "dpo",  "dpog", "vmos", "vmo",  "vmog", "asta", "asts", "intm", "acus", "acu",  "tmps",
     "tmp",  "pwm",  "ipwm", "icur", "pid",  "iimp", "ivar", "reca", "ijfl", "maxc"});
constexpr std::array kSetWords =
    std::to_array<std::string_view>({"pos",  "poss", "posg", "rel",  "rels", "relg", "vel",  "vels", "velg",
                                     "acc",  "accs", "accg", "vmos", "sto",  "stos", "stog", "icmd", "torq",
                                     "intm", "aen",  "adi",  "pid",  "iimp", "ivar", "reca", "llim", "vlim"});
// words of YARP's boards for what no board here lets be set
constexpr std::array kNeverSet =
    std::to_array<std::string_view>({"enc", "encs", "ere", "eres", "mnc", "mncs", "mre", "mres", "mcpr",
                                     "maxc", "acno", "acpk", "pwml", "tmpl", "gbxr"});
// words of YARP's boards for what neither the simulated nor the real boards of an iCub tell
constexpr std::array kNeverMeasured =
    std::to_array<std::string_view>({"mcpr", "tmpl", "gbxr", "acno", "acpk", "pwml", "avsu"});

// "'encz' cannot be got: did you mean 'encs'?"
std::string not_known(std::string_view verb, const TextValue& given,
                      std::span<const std::string_view> words) {
  const std::string what = given.text() != nullptr ? given.text()->substr(0, 20) : std::string("this");
  const std::string_view near = nearest_of(what, words);
  const std::string advice =
      near.empty() ? std::string("'help' lists what can") : fmt::format("did you mean '{} {}'?", verb, near);
  return fmt::format("'{}' cannot be {}: {}", what, verb == "get" ? "got" : "set", advice);
}

Outcome<ControlMode> mode_of(const TextValue& value) {
  // YARP's word for idle by force
  if (value.is_word("fidl")) return ControlMode::kIdle;
  const std::optional<ControlMode> mode =
      value.text() != nullptr ? mode_from_word(*value.text()) : std::nullopt;
  if (!mode) return unknown("a mode is one of idl, pos, posd, vel, torq, ipwm");
  return *mode;
}

// -- get
// --------------------------------------------------------------------------------------------------------------

// whether all motions, or those of some joints, have ended
Outcome<Values> get_all_done(const IControlBoard& board, const Values& line) {
  const Outcome<std::vector<int>> joints =
      asked_joints(line, 2, line[1].is_word("dons") ? 's' : 'g', board.axes());
  if (const auto* wrong = std::get_if<Refusal>(&joints)) return *wrong;
  const Result<std::vector<bool>> done = board.motion_done();
  if (!done) return refused(done.error());
  bool all_done = true;
  for (const int joint : std::get<std::vector<int>>(joints)) {
    all_done = all_done && (*done)[static_cast<std::size_t>(joint)];
  }
  return Values{{all_done ? 1LL : 0LL}};
}

Outcome<Values> get_modes(const IControlBoard& board, const Values& line) {
  if (line.size() < 3) return unknown("icmd cmod J, icmd cmds or icmd cmog N (J ...) is expected");
  const char suffix = line[2].is_word("cmds") ? 's' : line[2].is_word("cmog") ? 'g' : '\0';
  if (suffix == '\0' && !line[2].is_word("cmod")) return unknown("icmd knows cmod, cmds and cmog");
  const Outcome<std::vector<int>> asked = asked_joints(line, 3, suffix, board.axes());
  if (const auto* wrong = std::get_if<Refusal>(&asked)) return *wrong;
  const auto& joints = std::get<std::vector<int>>(asked);
  const Result<std::vector<ControlMode>> modes = board.control_modes();
  if (!modes) return refused(modes.error());
  Values words;
  for (const int joint : joints) words.push_back(word(mode_word((*modes)[static_cast<std::size_t>(joint)])));
  if (suffix == '\0') return Values{{static_cast<long long>(joints.front())}, words.front()};
  return Values{word(suffix == 's' ? "cmds" : "cmog"), {std::move(words)}};
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
  if (std::optional<Outcome<Values>> numbers = get_quantity(board, line)) return *numbers;
  const std::string_view what = text_of(line, 1);
  if (what == "info") return get_info(board);
  if (what == "dons" || what == "dong") return get_all_done(board, line);
  if (what == "icmd") return get_modes(board, line);
  if (std::optional<Outcome<Values>> motors = get_motors(board, line)) return *motors;
  if (what == "axes" || what == "mnum" || what == "mtnm") {
    return Values{{static_cast<long long>(board.axes())}};
  }
  if (what == "prot") return Values{{1LL}, {9LL}, {0LL}};
  if (what == "name" || what == "type") {
    const Outcome<std::vector<int>> joints = asked_joints(line, 2, '\0', board.axes());
    if (const auto* wrong = std::get_if<Refusal>(&joints)) return *wrong;
    if (what == "type") return Values{{kTurningJoint}};
    Result<std::string> name = board.axis_name(std::get<std::vector<int>>(joints).front());
    if (!name) return refused(name.error());
    return Values{{TextValue::Word{std::move(*name), false}}};
  }
  if (std::find(kNeverMeasured.begin(), kNeverMeasured.end(), what) != kNeverMeasured.end()) {
    return Refusal{true, fmt::format("no board here has '{}'", what)};
  }
  return unknown(not_known("get", line[1], kGetWords));
}

// -- set
// --------------------------------------------------------------------------------------------------------------

// a command with a number for each joint
struct Command {
  std::string_view stem;   // one joint; empty: there is no such word
  std::string_view all;    // all joints
  std::string_view group;  // some joints; empty: there is no such word
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

constexpr std::array<Command, 5> kCommands = {{
    {"pos", "poss", "posg", kDegree_rad,
     [](IControlBoard& b, Joints j, Numbers v) { return b.move_to(j, v); }},
    {"rel", "rels", "relg", kDegree_rad, &move_by},
    {"vel", "vels", "velg", kDegree_rad,
     [](IControlBoard& b, Joints j, Numbers v) { return b.set_reference_speeds(j, v); }},
    {"acc", "accs", "accg", kDegree_rad,
     [](IControlBoard& b, Joints j, Numbers v) { return b.set_reference_accelerations(j, v); }},
    {"", "vmos", "", kDegree_rad,
     [](IControlBoard& b, Joints j, Numbers v) { return b.set_velocities(j, v); }},
}};
constexpr Command kTorqueCommand = {
    "ref", "refs", "", 1.0, [](IControlBoard& b, Joints j, Numbers v) { return b.set_torques(j, v); }};

// what YARP's boards take from their port command:i alone
constexpr std::array kStreamed = std::to_array<std::array<std::string_view, 2>>({{"vmo", ""},
                                                                                 {"vmog", ""},
                                                                                 {"dpo", ""},
                                                                                 {"dpos", ""},
                                                                                 {"dpog", ""},
                                                                                 {"ipwm", "ref"},
                                                                                 {"ipwm", "refs"},
                                                                                 {"ipwm", "refg"},
                                                                                 {"torq", "refg"},
                                                                                 {"icur", "ref"},
                                                                                 {"icur", "refs"},
                                                                                 {"icur", "refg"}});

// 's', 'g', nothing, or no value when the word is none of the command's
std::optional<char> form(const Command& command, const TextValue& value) {
  if (!command.stem.empty() && value.is_word(command.stem)) return '\0';
  if (value.is_word(command.all)) return 's';
  if (!command.group.empty() && value.is_word(command.group)) return 'g';
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
  // whatever else somebody typed in a hurry, a stop is a stop
  const bool joint_is_missing = suffix == '\0' && line.size() < 3;
  if (joint_is_missing) return unknown("sto JOINT is expected; stos stops all");
  const Outcome<std::vector<int>> joints = asked_joints(line, 2, suffix, board.axes());
  if (const auto* wrong = std::get_if<Refusal>(&joints)) return *wrong;
  const Status stopped = board.stop(std::get<std::vector<int>>(joints));
  if (!stopped) return refused(stopped.error());
  return Values{};
}

// llim J MIN MAX, vlim J MIN MAX, where a top speed has no other minimum than 0
Outcome<Values> set_limits(IControlBoard& board, const Values& line) {
  if (line.size() != 5) return unknown("JOINT MIN MAX is expected");
  const Outcome<std::vector<int>> joints = asked_joints(line, 2, '\0', board.axes());
  if (const auto* wrong = std::get_if<Refusal>(&joints)) return *wrong;
  const Outcome<std::vector<double>> given = numbers({line[3], line[4]}, kDegree_rad);
  if (const auto* wrong = std::get_if<Refusal>(&given)) return *wrong;
  const int joint = std::get<std::vector<int>>(joints).front();
  const auto& range = std::get<std::vector<double>>(given);
  auto* settings = dynamic_cast<ILimitSettings*>(&board);
  if (settings == nullptr) return Refusal{true, "the limits of this board cannot be set"};
  const Status set = line[1].is_word("llim") ? settings->set_position_limits(joint, range[0], range[1])
                                             : settings->set_velocity_limit(joint, range[1]);
  if (!set) return refused(set.error());
  return Values{};
}

// an amplifier that is switched off leaves its joint idle
Outcome<Values> switch_amplifier(IControlBoard& board, const Values& line) {
  Outcome<Targets> which = targets(line, 2, '\0', board.axes(), false);
  if (auto* wrong = std::get_if<Refusal>(&which)) return *wrong;
  const ControlMode mode = line[1].is_word("adi") ? ControlMode::kIdle : ControlMode::kPosition;
  const Status switched = board.set_control_mode(std::get<Targets>(which).joints, mode);
  if (!switched) return refused(switched.error());
  return Values{};
}

Outcome<Values> set(IControlBoard& board, const Values& line) {
  const std::string_view what = text_of(line, 1);
  for (const auto& [word, second] : kStreamed) {
    if (what != word || (!second.empty() && text_of(line, 2) != second)) continue;
    return Refusal{true, fmt::format("'{}{}{}' is for streams, renewed every 100 ms: write it to command:i, "
                                     "as in (dpo 3) (45.0)",
                                     word, second.empty() ? "" : " ", second)};
  }
  for (const Command& command : kCommands) {
    if (const std::optional<char> suffix = form(command, line[1]))
      return send(board, command, *suffix, line, 2);
  }
  if (what == "sto") return stop(board, line, '\0');
  if (what == "stos") return stop(board, line, 's');
  if (what == "stog") return stop(board, line, 'g');
  if (what == "icmd") return set_modes(board, line);
  if (what == "llim" || what == "vlim") return set_limits(board, line);
  if (std::optional<Outcome<Values>> motors = set_motors(board, line)) return *motors;
  if (what == "aen" || what == "adi") return switch_amplifier(board, line);
  if (what == "torq") {
    const std::optional<char> suffix = line.size() > 2 ? form(kTorqueCommand, line[2]) : std::nullopt;
    if (suffix) return send(board, kTorqueCommand, *suffix, line, 3);
    return unknown("torq ref J V or torq refs (V ...) is expected");
  }
  if (std::find(kNeverSet.begin(), kNeverSet.end(), what) != kNeverSet.end()) {
    return Refusal{true, fmt::format("no board here lets '{}' be set", what)};
  }
  return unknown(not_known("set", line[1], kSetWords));
}

// as YARP's boards do it: [nak] to what is no request at all, [fail] to what cannot be done; and why
std::string refusal_text(const Refusal& refusal, std::size_t words) {
  return format_text({word(words < 2 ? "nak" : "fail"), {refusal.sentence}});
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
  static const std::string text = [] {
    Values lines = {word("many")};
    for (const char* line : {"degrees, deg/s, N m, percent; J is a joint, from 0",
                             "get encs | esps | eacs | mncs | msps | macs",
                             "get enc | esp | eac | mnc | msp | mac J",
                             "get poss | vels | accs | dpos | vmos, get pos | vel | acc | dpo | vmo J",
                             "get posg | velg | accg | dpog | vmog N (J ...)",
                             "get dons | donl, get don J, get dong N (J ...)",
                             "get icmd cmds | cmod J | cmog N (J ...)",
                             "get torq trqs | refs | rngs | trq J | ref J | rng J",
                             "get intm mods | mode J | modg N (J ...)",
                             "get acus | tmps, get acu | tmp | pwm | maxc J",
                             "get ipwm pwms | refs | pwm J | ref J",
                             "get icur refs | rngs | ref J | rng J",
                             "get pid pids | errs | refs | outs LOOP, get pid pid | err | ref | out LOOP J",
                             "    LOOP: pos vel trq cur",
                             "get iimp ipr | iof J",
                             "get ivar lvar | mvar NAME",
                             "get llim | vlim | name | type | asts J",
                             "get ijfl jhfl J",
                             "get axes | mnum | mtnm | asta | prot | info",
                             "set pos | rel | vel | acc J V",
                             "set poss | rels | vels | accs | vmos (V ...)",
                             "set posg | relg | velg | accg N (J ...) (V ...)",
                             "set sto J, set stos, set stog N (J ...)",
                             "set icmd cmod J MODE | cmds (MODE ...) | cmog N (J ...) (MODE ...)",
                             "    MODE: idl pos posd vel torq ipwm",
                             "set torq ref J V | refs (V ...)",
                             "set llim | vlim J MIN MAX",
                             "set intm mode J stif | comp, set aen | adi J",
                             "set pid pid LOOP J (10 gains)",
                             "set iimp ipr J (N*m/deg N*m*s/deg), set iimp iof J (N*m)",
                             "set ivar mvar NAME VALUE",
                             "set reca cal | hom | par J, set reca cals | homs | pars",
                             "calj J, cald J, park 1"}) {
      lines.push_back({std::string(line)});
    }
    return format_text(lines);
  }();
  return text;
}

std::string ControlBoardText::reply(const std::string& line) {
  Result<std::vector<TextValue>> parsed = parse_text(line);
  if (!parsed) return refusal_text(unknown(parsed.error().message), 0);
  const Values& words = *parsed;
  if (!words.empty() && words[0].is_word("help")) return help();
  const bool is_get = !words.empty() && words[0].is_word("get");
  const bool is_set = !words.empty() && words[0].is_word("set");
  if (std::optional<Outcome<Values>> ordered = order_motors(board_, words)) {
    const auto* wrong = std::get_if<Refusal>(&*ordered);
    return wrong != nullptr ? refusal_text(*wrong, words.size()) : "[ok]";
  }
  if (words.size() < 2 || (!is_get && !is_set)) {
    return refusal_text(unknown("a line begins with 'get WHAT' or 'set WHAT'; 'help' tells more"),
                        words.size());
  }
  Outcome<Values> outcome = is_get ? get(board_, words) : set(board_, words);
  if (auto* wrong = std::get_if<Refusal>(&outcome)) {
    constexpr std::size_t kQuoted = 80;  // characters of the line that are repeated
    if (!wrong->understood)
      wrong->sentence = fmt::format("'{}': {}", line.substr(0, kQuoted), wrong->sentence);
    return refusal_text(*wrong, words.size());
  }
  if (is_set) return "[ok]";
  // [is] WHAT values [tsta] count time [ok], with WHAT as it was asked; four words have forms of their own
  const std::string_view what = text_of(words, 1);
  const bool is_version = what == "prot";
  Values answer;
  if (is_version) {
    answer.push_back(word("prot"));
  } else if (what != "intm") {
    answer.push_back(word("is"));
    if (what != "icmd" && what != "ijfl") answer.push_back(words[1]);
  }
  for (TextValue& value : std::get<Values>(outcome)) answer.push_back(std::move(value));
  if (!is_version && !tells_no_time(words)) {
    const Result<JointReading> reading = board_.read_joints();
    answer.push_back(word("tsta"));
    answer.push_back({static_cast<long long>(count_.fetch_add(1))});
    answer.push_back({reading ? static_cast<double>(reading->stamp_ns) * 1e-9 : 0.0});
  }
  answer.push_back(word("ok"));
  return format_text(answer);
}

}  // namespace nido
