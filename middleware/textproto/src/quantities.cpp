#include "quantities.h"

#include <algorithm>
#include <array>
#include <span>

#include "nido/interfaces/board_extras.h"

namespace nido::text_line {
namespace {

using Numbers = Result<std::vector<double>>;

Error not_told() { return {ErrorCode::kUnsupported, "this board does not tell it"}; }

template <auto member>
Numbers of_joints(const IControlBoard& board) {
  Result<JointReading> reading = board.read_joints();
  if (!reading) return reading.error();
  return std::move((*reading).*member);
}

template <auto member>
Numbers of_motors(const IControlBoard& board) {
  Result<MotorReading> reading = board.read_motors();
  if (!reading) return reading.error();
  if (((*reading).*member).empty()) {
    return Error{ErrorCode::kUnsupported, "the motors of this board do not measure this"};
  }
  return std::move((*reading).*member);
}

Numbers of_flags(const Result<std::vector<bool>>& flags) {
  if (!flags) return flags.error();
  return std::vector<double>(flags->begin(), flags->end());
}

template <ControlMode mode>
Numbers commanded(const IControlBoard& board) {
  const auto* extra = dynamic_cast<const ICommanded*>(&board);
  if (extra == nullptr) return not_told();
  return extra->commanded(mode);
}

Numbers greatest_currents(const IControlBoard& board) {
  const auto* extra = dynamic_cast<const ICurrentRange*>(&board);
  if (extra == nullptr) return not_told();
  return extra->greatest_currents();
}

// no joint is ever driven with a wanted current
Numbers wanted_currents(const IControlBoard& board) {
  Numbers currents = of_motors<&MotorReading::current_A>(board);
  if (!currents) return currents;
  return std::vector<double>(currents->size(), 0.0);
}

struct Quantity {
  std::string_view one;    // word for one joint
  std::string_view all;    // word for all joints; empty: there is none
  std::string_view group;  // word for some joints; empty: there is none
  double unit;             // of the number on this side, in SI
  Numbers (*read)(const IControlBoard&);
};

constexpr auto kPlain = std::to_array<Quantity>({
    {"enc", "encs", "", kDegree_rad, &of_joints<&JointReading::position_rad>},
    {"esp", "esps", "", kDegree_rad, &of_joints<&JointReading::velocity_rad_s>},
    {"eac", "eacs", "", kDegree_rad, &of_joints<&JointReading::acceleration_rad_s2>},
    {"pos", "poss", "posg", kDegree_rad, [](const IControlBoard& b) { return b.target_positions(); }},
    {"dpo", "dpos", "dpog", kDegree_rad, &commanded<ControlMode::kDirect>},
    {"vmo", "vmos", "vmog", kDegree_rad, &commanded<ControlMode::kVelocity>},
    {"vel", "vels", "velg", kDegree_rad, [](const IControlBoard& b) { return b.reference_speeds(); }},
    {"acc", "accs", "accg", kDegree_rad, [](const IControlBoard& b) { return b.reference_accelerations(); }},
    {"don", "donl", "", kCount, [](const IControlBoard& b) { return of_flags(b.motion_done()); }},
    {"mnc", "mncs", "", kDegree_rad, &of_motors<&MotorReading::position_rad>},
    {"msp", "msps", "", kDegree_rad, &of_motors<&MotorReading::velocity_rad_s>},
    {"mac", "macs", "", kDegree_rad, &of_motors<&MotorReading::acceleration_rad_s2>},
    {"acu", "acus", "", 1.0, &of_motors<&MotorReading::current_A>},
    {"maxc", "", "", 1.0, &greatest_currents},
    {"tmp", "tmps", "", 1.0, &of_motors<&MotorReading::temperature_C>},
    {"pwm", "", "", kPercent, &of_motors<&MotorReading::duty_cycle>},
    {"asts", "asta", "", kCount, [](const IControlBoard& b) { return of_flags(b.amplifiers_on()); }},
});
constexpr auto kTorque = std::to_array<Quantity>({
    {"trq", "trqs", "", 1.0, &of_joints<&JointReading::torque_Nm>},
    {"ref", "refs", "refg", 1.0, &commanded<ControlMode::kTorque>},
});
constexpr auto kPwm = std::to_array<Quantity>({
    {"pwm", "pwms", "", kPercent, &of_motors<&MotorReading::duty_cycle>},
    {"ref", "refs", "", kPercent, &commanded<ControlMode::kPwm>},
});
constexpr auto kCurrent = std::to_array<Quantity>({
    {"ref", "refs", "", 1.0, &wanted_currents},
});

// from where to where a number may go
struct Range {
  std::string_view one;
  std::string_view all;  // empty: there is none
  double unit;
  // of all joints: the smallest, then the greatest
  Result<std::array<std::vector<double>, 2>> (*read)(const IControlBoard&);
};

template <auto smallest, auto greatest>
Result<std::array<std::vector<double>, 2>> of_limits(const IControlBoard& board) {
  const Result<std::vector<JointLimits>> limits = board.limits();
  if (!limits) return limits.error();
  std::array<std::vector<double>, 2> range;
  for (const JointLimits& joint : *limits) {
    range[0].push_back(smallest(joint));
    range[1].push_back(greatest(joint));
  }
  return range;
}

Result<std::array<std::vector<double>, 2>> of_currents(const IControlBoard& board) {
  Numbers greatest = greatest_currents(board);
  if (!greatest) return greatest.error();
  std::vector<double> smallest;
  for (const double current_A : *greatest) smallest.push_back(-current_A);
  return std::array{std::move(smallest), std::move(*greatest)};
}

constexpr auto kPlainRanges = std::to_array<Range>({
    {"llim", "", kDegree_rad,
     &of_limits<[](const JointLimits& j) { return j.min_rad; },
                [](const JointLimits& j) { return j.max_rad; }>},
    {"vlim", "", kDegree_rad,
     &of_limits<[](const JointLimits&) { return 0.0; },
                [](const JointLimits& j) { return j.max_velocity_rad_s; }>},
});
constexpr auto kTorqueRanges = std::to_array<Range>({
    {"rng", "rngs", 1.0,
     &of_limits<[](const JointLimits& j) { return -j.max_torque_Nm; },
                [](const JointLimits& j) { return j.max_torque_Nm; }>},
});
constexpr auto kCurrentRanges = std::to_array<Range>({{"rng", "rngs", 1.0, &of_currents}});

// words behind one that names an interface
struct Interface {
  std::string_view name;  // empty: the words stand alone
  std::span<const Quantity> quantities;
  std::span<const Range> ranges;
};
constexpr auto kInterfaces = std::to_array<Interface>({{"", kPlain, kPlainRanges},
                                                       {"torq", kTorque, kTorqueRanges},
                                                       {"ipwm", kPwm, {}},
                                                       {"icur", kCurrent, kCurrentRanges}});

Values chosen(const std::vector<double>& numbers, std::span<const int> joints, double unit) {
  Values values;
  for (const int joint : joints) values.push_back(to_value(numbers[static_cast<std::size_t>(joint)], unit));
  return values;
}

// 's', 'g', '\0' for one joint; nothing when the word is none of these
std::optional<char> form(const TextValue& value, std::string_view one, std::string_view all,
                         std::string_view group) {
  if (value.is_word(one)) return '\0';
  if (!all.empty() && value.is_word(all)) return 's';
  if (!group.empty() && value.is_word(group)) return 'g';
  return std::nullopt;
}

std::optional<Outcome<Values>> get(const IControlBoard& board, const Interface& interface, const Values& line,
                                   std::size_t at) {
  for (const Quantity& quantity : interface.quantities) {
    const std::optional<char> suffix = form(line[at], quantity.one, quantity.all, quantity.group);
    if (!suffix) continue;
    const Outcome<std::vector<int>> joints = asked_joints(line, at + 1, *suffix, board.axes());
    if (const auto* wrong = std::get_if<Refusal>(&joints)) return *wrong;
    const Numbers read = quantity.read(board);
    if (!read) return refused(read.error());
    Values found = chosen(*read, std::get<std::vector<int>>(joints), quantity.unit);
    if (*suffix == '\0') return found;
    return Values{{std::move(found)}};
  }
  for (const Range& range : interface.ranges) {
    const std::optional<char> suffix = form(line[at], range.one, range.all, "");
    if (!suffix) continue;
    const Outcome<std::vector<int>> joints = asked_joints(line, at + 1, *suffix, board.axes());
    if (const auto* wrong = std::get_if<Refusal>(&joints)) return *wrong;
    const auto read = range.read(board);
    if (!read) return refused(read.error());
    Values found;
    for (const std::vector<double>& end : *read) {
      Values numbers = chosen(end, std::get<std::vector<int>>(joints), range.unit);
      found.push_back(*suffix == '\0' ? std::move(numbers.front()) : TextValue{std::move(numbers)});
    }
    return found;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Outcome<Values>> get_quantity(const IControlBoard& board, const Values& line) {
  const auto named = std::find_if(kInterfaces.begin(), kInterfaces.end(), [&](const Interface& interface) {
    return !interface.name.empty() && line[1].is_word(interface.name);
  });
  if (named == kInterfaces.end()) return get(board, kInterfaces.front(), line, 1);
  if (line.size() > 2) {
    if (std::optional<Outcome<Values>> found = get(board, *named, line, 2)) return found;
  }
  std::string words;
  const auto add = [&](std::string_view word, std::string_view what) {
    if (!word.empty()) words += fmt::format("{}{}{}", words.empty() ? "" : ", ", word, what);
  };
  for (const Quantity& quantity : named->quantities) {
    add(quantity.one, " J");
    add(quantity.all, "");
  }
  for (const Range& range : named->ranges) {
    add(range.one, " J");
    add(range.all, "");
  }
  return unknown(fmt::format("{} knows {}", named->name, words));
}

}  // namespace nido::text_line
