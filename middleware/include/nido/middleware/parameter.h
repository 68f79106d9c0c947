#pragma once

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// What people and tools are told of a parameter, and what its values are checked against.
struct ParameterAbout {
  std::string about = {};                 // a sentence: what it changes
  std::string unit = {};                  // "m", "rad/s"; empty: a count, a word, a switch
  std::optional<double> min = {};         // of numbers, and of each number of a list; inclusive
  std::optional<double> max = {};         // the same
  std::vector<std::string> choices = {};  // of texts: what is allowed; empty: anything
};

// A parameter of a running node, as `nido param list` shows it.
struct ParameterDescription {
  std::string key;    // "camera.width"
  std::string type;   // "bool", "int", "double", "string", "list of double", ...
  std::string value;  // in YAML, on one line
  ParameterAbout about;
  bool live = false;  // can be set while the node runs
};

// Where a dotted key leads in a tree of settings; undefined where it leads nowhere. Changes nothing.
YAML::Node find_parameter(const YAML::Node& tree, const std::string& key);
// A value on one line: maps and lists in brackets.
std::string parameter_text(const YAML::Node& value);
// The parameters of a node as the tree that `--node FILE` and `--set` make: each at its place.
YAML::Node parameter_tree(const std::vector<ParameterDescription>& parameters);
// Descriptions as text and back, for the wire: YAML, one parameter a document of a sequence.
std::string to_text(const std::vector<ParameterDescription>& parameters);
Result<std::vector<ParameterDescription>> parse_parameters(const std::string& text);

namespace detail {

template <class T>
struct ParameterItem {
  using type = T;
  static constexpr bool is_list = false;
};
template <class T>
struct ParameterItem<std::vector<T>> {
  using type = T;
  static constexpr bool is_list = true;
};

template <class T>
std::string parameter_type() {
  using Item = typename ParameterItem<T>::type;
  std::string name = "value";
  if constexpr (std::is_same_v<Item, bool>) {
    name = "bool";
  } else if constexpr (std::is_integral_v<Item>) {
    name = "int";
  } else if constexpr (std::is_floating_point_v<Item>) {
    name = "double";
  } else if constexpr (std::is_same_v<Item, std::string>) {
    name = "string";
  }
  return ParameterItem<T>::is_list ? "list of " + name : name;
}

// Why a value of this type is not allowed; empty if it is.
std::string refusal_of(double value, const ParameterAbout& about);
std::string refusal_of(const std::string& value, const ParameterAbout& about);

// The value, if it is of type T and within what is said of it; `place` begins the sentence of a refusal.
template <class T>
Result<T> checked_parameter(const YAML::Node& value, const ParameterAbout& about, const std::string& place) {
  using Item = typename ParameterItem<T>::type;
  T out{};
  try {
    out = value.as<T>();
  } catch (const YAML::Exception&) {
    return Error{ErrorCode::kInvalidArgument, place + " cannot be '" + parameter_text(value) +
                                                  "': " + parameter_type<T>() + " is expected"};
  }
  const auto refusal = [&about](const auto& item) -> std::string {
    if constexpr (std::is_same_v<Item, std::string>) {
      return refusal_of(item, about);
    } else if constexpr (std::is_arithmetic_v<Item> && !std::is_same_v<Item, bool>) {
      return refusal_of(static_cast<double>(item), about);
    } else {
      return "";
    }
  };
  std::string why;
  if constexpr (ParameterItem<T>::is_list) {
    for (const auto& item : out) {
      if (why.empty()) why = refusal(static_cast<Item>(item));
    }
  } else {
    why = refusal(out);
  }
  if (!why.empty()) {
    return Error{ErrorCode::kInvalidArgument, place + " cannot be '" + parameter_text(value) + "': " + why};
  }
  return out;
}

}  // namespace detail

// The value of a parameter that can be set from outside while the node runs. Thread-safe.
template <class T>
class LiveParameter {
 public:
  explicit LiveParameter(T value) : value_(std::move(value)) {}
  [[nodiscard]] T get() const {
    const std::lock_guard lock(mutex_);
    return value_;
  }
  void set(T value) {
    const std::lock_guard lock(mutex_);
    value_ = std::move(value);
  }

 private:
  mutable std::mutex mutex_;
  T value_;
};

}  // namespace nido
