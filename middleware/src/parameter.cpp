#include "nido/middleware/parameter.h"

#include <array>
#include <charconv>
#include <cmath>

namespace nido {

namespace {

std::string number_text(double value) {
  YAML::Emitter out;
  out << value;
  return out.c_str();
}

// 0.29999999999999999, as the library writes what was 0.3 in the code, is 0.3 again.
YAML::Node shortened(const YAML::Node& value) {
  if (value.IsScalar() && value.Scalar().size() > 16) {
    const std::string& text = value.Scalar();
    double number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) return value;
    std::array<char, 32> shortest{};
    const auto written = std::to_chars(shortest.data(), shortest.data() + shortest.size(), number);
    return YAML::Node(std::string(shortest.data(), written.ptr));
  }
  if (!value.IsSequence()) return value;
  YAML::Node list(YAML::NodeType::Sequence);
  for (const auto& item : value) list.push_back(shortened(item));
  return list;
}

void put(YAML::Node tree, const std::string& key, const YAML::Node& value) {
  const std::size_t dot = key.find('.');
  if (dot == std::string::npos) {
    tree[key] = value;
    return;
  }
  const std::string group = key.substr(0, dot);
  if (!tree[group].IsMap()) tree[group] = YAML::Node(YAML::NodeType::Map);
  put(tree[group], key.substr(dot + 1), value);
}

}  // namespace

YAML::Node find_parameter(const YAML::Node& tree, const std::string& key) {
  YAML::Node place;
  place.reset(tree);
  for (std::size_t begin = 0; begin <= key.size();) {
    const std::size_t end = std::min(key.find('.', begin), key.size());
    // const: else looking for a key that is absent would add it
    const YAML::Node& group = place;
    const YAML::Node inner =
        group.IsMap() ? group[key.substr(begin, end - begin)] : YAML::Node(YAML::NodeType::Undefined);
    if (!inner.IsDefined()) return YAML::Node(YAML::NodeType::Undefined);
    place.reset(inner);
    begin = end + 1;
  }
  return place;
}

std::string parameter_text(const YAML::Node& value) {
  YAML::Emitter out;
  out.SetMapFormat(YAML::Flow);
  out.SetSeqFormat(YAML::Flow);
  out << shortened(value);
  return out.c_str();
}

YAML::Node parameter_tree(const std::vector<ParameterDescription>& parameters) {
  YAML::Node tree(YAML::NodeType::Map);
  for (const ParameterDescription& parameter : parameters) {
    put(tree, parameter.key, YAML::Load(parameter.value));
  }
  return tree;
}

std::string to_text(const std::vector<ParameterDescription>& parameters) {
  YAML::Node list(YAML::NodeType::Sequence);
  for (const ParameterDescription& parameter : parameters) {
    YAML::Node one;
    one["key"] = parameter.key;
    one["type"] = parameter.type;
    one["value"] = parameter.value;
    one["live"] = parameter.live;
    if (!parameter.about.about.empty()) one["about"] = parameter.about.about;
    if (!parameter.about.unit.empty()) one["unit"] = parameter.about.unit;
    if (parameter.about.min) one["min"] = *parameter.about.min;
    if (parameter.about.max) one["max"] = *parameter.about.max;
    if (!parameter.about.choices.empty()) one["choices"] = parameter.about.choices;
    list.push_back(one);
  }
  return YAML::Dump(list);
}

Result<std::vector<ParameterDescription>> parse_parameters(const std::string& text) {
  std::vector<ParameterDescription> parameters;
  try {
    for (const auto& one : YAML::Load(text)) {
      ParameterDescription parameter;
      parameter.key = one["key"].as<std::string>();
      parameter.type = one["type"].as<std::string>();
      parameter.value = one["value"].as<std::string>();
      parameter.live = one["live"].as<bool>();
      if (one["about"]) parameter.about.about = one["about"].as<std::string>();
      if (one["unit"]) parameter.about.unit = one["unit"].as<std::string>();
      if (one["min"]) parameter.about.min = one["min"].as<double>();
      if (one["max"]) parameter.about.max = one["max"].as<double>();
      if (one["choices"]) parameter.about.choices = one["choices"].as<std::vector<std::string>>();
      parameters.push_back(std::move(parameter));
    }
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kFailed, std::string("this is no list of parameters: ") + e.what()};
  }
  return parameters;
}

namespace detail {

std::string refusal_of(double value, const ParameterAbout& about) {
  const bool is_bounded = about.min || about.max;
  if (is_bounded && std::isnan(value)) return "a number is expected";
  const std::string unit = about.unit.empty() ? "" : " " + about.unit;
  const bool is_low = about.min && value < *about.min;
  const bool is_high = about.max && value > *about.max;
  if (!is_low && !is_high) return "";
  if (about.min && about.max) {
    return "from " + number_text(*about.min) + " to " + number_text(*about.max) + unit + " is allowed";
  }
  return about.min ? "at least " + number_text(*about.min) + unit + " is allowed"
                   : "at most " + number_text(*about.max) + unit + " is allowed";
}

std::string refusal_of(const std::string& value, const ParameterAbout& about) {
  if (about.choices.empty() || std::ranges::find(about.choices, value) != about.choices.end()) return "";
  std::string text;
  for (const std::string& choice : about.choices) text += (text.empty() ? "" : ", ") + choice;
  return "one of " + text + " is allowed";
}

}  // namespace detail

}  // namespace nido
