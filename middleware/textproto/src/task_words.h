#pragma once

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "line.h"
#include "nido/textproto/task_text.h"

// Lines of the devices of the task: read, written, asked.
namespace nido::task_words {

using text_line::kDegree_rad;
using text_line::Values;

inline std::string fail(const std::string& reason) {
  return format_text({TextValue{TextValue::Word{"fail", true}}, TextValue{reason}});
}
inline std::string outcome(const Status& status) { return status ? "[ok]" : fail(status.error().message); }

template <class Numbers>
std::string list(const Numbers& numbers) {
  std::string text = "(";
  for (const double number : numbers) text += (text.size() > 1 ? " " : "") + format_number(number);
  return text + ")";
}

// the words of a line that begins with `first`, as numbers; a bare word in their midst ends them
inline std::vector<double> numbers_from(const Values& words, std::size_t first) {
  std::vector<double> numbers;
  for (std::size_t i = first; i < words.size() && words[i].is_number(); ++i) {
    numbers.push_back(words[i].number());
  }
  return numbers;
}

template <class Numbers>
std::string degrees(const Numbers& angles_rad) {
  std::vector<double> angles_deg;
  for (const double angle_rad : angles_rad) angles_deg.push_back(angle_rad / kDegree_rad);
  return list(angles_deg);
}

inline std::array<double, 7> pose_numbers(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  return {X.translation().x(), X.translation().y(), X.translation().z(), q.x(), q.y(), q.z(), q.w()};
}

// X Y Z QX QY QZ QW
inline Result<Eigen::Isometry3d> pose_from(std::span<const double> n) {
  if (n.size() != 7) {
    return Error{ErrorCode::kInvalidArgument, "a pose is X Y Z in m and QX QY QZ QW of its turn"};
  }
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Eigen::Vector3d(n[0], n[1], n[2]);
  const Eigen::Quaterniond q(n[6], n[3], n[4], n[5]);
  if (!(std::abs(q.norm() - 1.0) < 0.01)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a turn is a quaternion x y z w of length 1, not {:.3g}", q.norm())};
  }
  X.linear() = q.normalized().toRotationMatrix();
  return X;
}

// the answer's words after [is] and what was asked
inline Result<Values> answered(const AskLine& ask, const std::string& line) {
  const Result<std::string> answer = ask(line);
  if (!answer) return answer.error();
  Result<Values> words = parse_text(*answer);
  if (!words || words->empty()) {
    return Error{ErrorCode::kFailed, fmt::format("the answer to '{}' is not understood", line)};
  }
  if (words->front().is_word("ok")) return Values{};
  if (!words->front().is_word("is") || words->size() < 3) {
    const std::string* reason = words->size() > 1 ? (*words)[1].text() : nullptr;
    return Error{ErrorCode::kFailed, reason != nullptr ? *reason : "refused: " + line};
  }
  words->erase(words->begin(), words->begin() + 2);
  return words;
}

inline Status ordered(const AskLine& ask, const std::string& line) {
  const Result<Values> words = answered(ask, line);
  return words ? Status() : Status(words.error());
}

// the numbers of a list; nothing when it is none, or holds something else
inline std::optional<std::vector<double>> numbers_of_list(const Values& words, std::size_t at) {
  if (at >= words.size() || words[at].list() == nullptr) return std::nullopt;
  std::vector<double> numbers = numbers_from(*words[at].list(), 0);
  if (numbers.size() != words[at].list()->size()) return std::nullopt;
  return numbers;
}

// numbers and lists of numbers, in this order; each entry of `shape` is the length of a list, 0 for a number
inline std::optional<std::vector<double>> flat(const Values& words,
                                               std::initializer_list<std::size_t> shape) {
  std::vector<double> out;
  if (words.size() < shape.size()) return std::nullopt;
  std::size_t at = 0;
  for (const std::size_t length : shape) {
    const TextValue& word = words[at++];
    if (length == 0) {
      if (!word.is_number()) return std::nullopt;
      out.push_back(word.number());
      continue;
    }
    if (word.list() == nullptr || word.list()->size() != length) return std::nullopt;
    for (const TextValue& value : *word.list()) {
      if (!value.is_number()) return std::nullopt;
      out.push_back(value.number());
    }
  }
  return out;
}

inline Error strange() { return {ErrorCode::kFailed, "the far side's state is not understood"}; }

}  // namespace nido::task_words
