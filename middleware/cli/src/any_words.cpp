#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "nido/cli/any_type.h"

namespace nido {
namespace {

// A quoted scalar is text; a plain one is what JSON would make of it, or text.
Json json_of_yaml(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Sequence: {
      Json list = Json::array();
      for (const auto& item : node) list.push_back(json_of_yaml(item));
      return list;
    }
    case YAML::NodeType::Map: {
      Json object = Json::object();
      for (const auto& item : node) object[item.first.Scalar()] = json_of_yaml(item.second);
      return object;
    }
    case YAML::NodeType::Scalar: {
      const std::string text = node.Scalar();
      if (node.Tag() == "!") return text;
      if (text == "true" || text == "false") return text == "true";
      auto value = Json::parse(text, nullptr, false);
      if (value.is_number()) return value;
      // YAML's wider notion of a number: .5, +3, 1.
      double number = 0;
      if (!text.empty() && text.find_first_not_of("+-.0123456789eE") == std::string::npos &&
          YAML::convert<double>::decode(node, number)) {
        return number;
      }
      return text;
    }
    default:
      return nullptr;
  }
}

Result<Json> parse(const std::string& text) {
  try {
    return json_of_yaml(YAML::Load(text));
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("'{}' is no YAML: {}", text, e.msg)};
  }
}

void write_text(const Json& value, const std::string& indent, std::string& text) {
  if (value.is_object()) {
    for (const auto& [key, inner] : value.items()) {
      const bool cut =
          inner.is_object() && inner.size() == 2 && inner.contains("length") && inner.contains("first");
      if (cut) {
        std::string first = inner["first"].dump();
        first.pop_back();
        text += fmt::format("{}{}: {}, ...] ({} in all)\n", indent, key, first,
                            inner["length"].get<std::size_t>());
      } else if (inner.is_object() || (inner.is_array() && !inner.empty() && inner.front().is_object())) {
        text += fmt::format("{}{}:\n", indent, key);
        write_text(inner, indent + "  ", text);
      } else {
        text += fmt::format("{}{}: {}\n", indent, key,
                            inner.is_string() ? inner.get<std::string>() : inner.dump());
      }
    }
  } else if (value.is_array()) {
    for (const auto& inner : value) {
      std::string item;
      write_text(inner, indent + "  ", item);
      if (item.size() > indent.size()) item[indent.size()] = '-';
      text += item;
    }
  } else {
    text += indent + value.dump() + "\n";
  }
}

}  // namespace

Result<Json> json_of_words(const AnyType& type, const std::vector<std::string>& words) {
  std::string whole;
  for (const auto& word : words) whole += (whole.empty() ? "" : " ") + word;
  // a list of anything has a notation of its own, in which braces are blobs
  if (type.name == "nido_msgs/msg/Values") return Json{{"text", whole}};
  if (words.size() == 1 && words.front().starts_with('{')) return parse(words.front());
  std::vector<std::string> content = type.fields;
  std::erase(content, "header");
  if (content.size() == 1 && !words.empty() && !words.front().starts_with(content.front() + "=")) {
    // `write /text hello` and `write /text 3` mean the text
    if (type.name == "std_msgs/msg/String") return Json{{content.front(), whole}};
    auto value = parse(whole);
    if (!value) return value;
    return Json{{content.front(), *value}};
  }
  Json object = Json::object();
  for (const auto& word : words) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0) {
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("'{}' is no FIELD=VALUE; give one map, as in '{{{}: ...}}', or fields of {}",
                               word, content.empty() ? "" : content.front(), type.name)};
    }
    auto value = parse(word.substr(equals + 1));
    if (!value) return value;
    Json* place = &object;
    std::string path = word.substr(0, equals);
    for (std::size_t dot = path.find('.'); dot != std::string::npos; dot = path.find('.')) {
      place = &(*place)[path.substr(0, dot)];
      path.erase(0, dot + 1);
    }
    (*place)[path] = *value;
  }
  return object;
}

std::string text_of(const Json& value) {
  std::string text;
  write_text(value, "", text);
  return text;
}

}  // namespace nido
