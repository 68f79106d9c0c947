#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "nido/interfaces/check_joints.h"
#include "nido/textproto/text_value.h"

// Reading one line of the control-board vocabulary, and what cannot be done of it.
namespace nido::text_line {

constexpr double kDegree_rad = std::numbers::pi / 180.0;
constexpr double kPercent = 0.01;
constexpr double kCount = 0;  // unit of whole numbers

using Values = std::vector<TextValue>;

inline TextValue word(std::string_view text) { return {TextValue::Word{std::string(text), true}}; }

// what a line could not do, and whether it was understood
struct Refusal {
  bool understood = true;
  std::string sentence;
};
inline Refusal refused(const Error& error) { return {true, error.message}; }
inline Refusal unknown(std::string sentence) { return {false, std::move(sentence)}; }

template <class T>
using Outcome = std::variant<T, Refusal>;

// -- reading a line
// ---------------------------------------------------------------------------------------------------

// the joints that a line names, and what it gives to each
struct Targets {
  std::vector<int> joints;
  Values values;
};

inline std::optional<int> whole_number(const TextValue& value) {
  const auto* whole = std::get_if<long long>(&value.content);
  if (whole == nullptr || *whole < -1'000'000 || *whole > 1'000'000) return std::nullopt;
  return static_cast<int>(*whole);
}

inline Outcome<std::vector<int>> joint_list(const TextValue& value) {
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
inline Outcome<Targets> targets(const Values& line, std::size_t first, char suffix, int axes,
                                bool with_values) {
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

// The joints of a question. As YARP's boards do it, one without a joint is about joint 0, and what stands
// behind is left alone: nothing is changed by a question.
inline Outcome<std::vector<int>> asked_joints(const Values& line, std::size_t first, char suffix, int axes) {
  const std::size_t words = suffix == 's' ? 0 : suffix == 'g' ? 2 : 1;
  Values question(line.begin(),
                  line.begin() + static_cast<std::ptrdiff_t>(std::min(line.size(), first + words)));
  if (suffix == '\0' && question.size() == first) question.push_back({0LL});
  Outcome<Targets> which = targets(question, first, suffix, axes, false);
  if (auto* wrong = std::get_if<Refusal>(&which)) return *wrong;
  return std::get<Targets>(std::move(which)).joints;
}

inline Outcome<std::vector<double>> numbers(const Values& values, double unit) {
  std::vector<double> out;
  for (const TextValue& value : values) {
    if (!value.is_number()) return unknown("a value is a number");
    out.push_back(value.number() * unit);
  }
  return out;
}

// The word or string at a place; empty where there is none.
inline std::string_view text_of(const Values& line, std::size_t at) {
  const std::string* text = at < line.size() ? line[at].text() : nullptr;
  return text != nullptr ? std::string_view(*text) : std::string_view();
}

inline TextValue to_value(double si, double unit) {
  if (unit == kCount) return {static_cast<long long>(si)};
  // a target of 30.5 degrees reads back as 30.5: the two conversions leave an error in the last digits
  constexpr double kDigits = 1e10;
  return {std::round(si / unit * kDigits) / kDigits};
}

}  // namespace nido::text_line
