#include "nido/launcher/schema.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <optional>

#include "nido/launcher/suggest.h"

namespace nido {
namespace {

std::vector<std::string> keys_of(const Schema& schema) {
  std::vector<std::string> keys;
  for (const auto& field : schema.fields) keys.push_back(field.key);
  return keys;
}

const Field* find_field(const Schema& schema, const std::string& key) {
  for (const auto& field : schema.fields) {
    if (field.key == key) return &field;
  }
  return nullptr;
}

// What stands in the file, short enough for a sentence.
std::string shown(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar: {
      const std::string text = node.Scalar();
      return "'" + (text.size() > 60 ? text.substr(0, 57) + "..." : text) + "'";
    }
    case YAML::NodeType::Sequence:
      return fmt::format("a list of {}", node.size());
    case YAML::NodeType::Map:
      return "a map";
    default:
      return "nothing";
  }
}

std::string expected(const Field& field) {
  const auto bounds = [&field](const std::string& noun) {
    const bool low = std::isfinite(field.min);
    const bool high = std::isfinite(field.max);
    if (low && high) return fmt::format("{} from {} to {}", noun, field.min, field.max);
    if (low) return fmt::format("{}, at least {}", noun, field.min);
    if (high) return fmt::format("{}, at most {}", noun, field.max);
    return noun;
  };
  switch (field.kind) {
    case ValueKind::kText:
      return field.allowed.empty() ? "text" : "one of " + join_words(field.allowed);
    case ValueKind::kFlag:
      return "true or false";
    case ValueKind::kInteger:
      return bounds("a whole number");
    case ValueKind::kNumber:
      return bounds("a number");
    case ValueKind::kNumberOrMax:
      return "a positive number or max";
    case ValueKind::kTextList:
      return "a list of texts, as in [a, b]";
    case ValueKind::kTextMap:
      return "a map of texts, as in {a: b}";
    case ValueKind::kAnyMap:
      return "a map";
    case ValueKind::kMap:
      return "a map with the keys " + join_words(keys_of(*field.inner));
    case ValueKind::kList:
      return fmt::format("a list of maps, each a {} with the keys {}", field.inner->what,
                         join_words(keys_of(*field.inner)));
  }
  return "something else";
}

class Checker {
 public:
  Checker(std::string file, const std::vector<Override>& overrides)
      : file_(std::move(file)), overrides_(overrides) {}

  Result<YAML::Node> map(const YAML::Node& node, const Schema& schema, const std::string& path,
                         const std::string& label) {
    if (!node.IsMap()) {
      return wrong(node, path,
                   fmt::format("{} is {}; expected a map with the keys {}", label, shown(node),
                               join_words(keys_of(schema))));
    }
    std::map<std::string, YAML::Node> found;
    std::map<std::string, int> lines;
    for (const auto& entry : node) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
      const std::string inner_path = path.empty() ? key : path + "." + key;
      if (find_field(schema, key) == nullptr) {
        const auto keys = keys_of(schema);
        const std::string near = nearest_word(key, keys);
        return wrong(
            entry.first, inner_path,
            fmt::format("{} has no key {}{}; allowed: {}", label, shown(entry.first),
                        near.empty() ? "" : fmt::format("; did you mean '{}'?", near), join_words(keys)));
      }
      if (found.contains(key)) {
        return wrong(
            entry.first, inner_path,
            fmt::format("the key '{}' of {} is given twice, first in line {}", key, label, lines[key]));
      }
      found.emplace(key, entry.second);
      lines[key] = entry.first.Mark().line + 1;
    }

    YAML::Node filled(YAML::NodeType::Map);
    for (const auto& field : schema.fields) {
      const std::string inner_path = path.empty() ? field.key : path + "." + field.key;
      const auto it = found.find(field.key);
      const bool absent = it == found.end() || it->second.IsNull();
      if (absent && field.required) {
        return wrong(
            node, path,
            fmt::format("{} lacks the key '{}' ({}): {}", label, field.key, expected(field), field.meaning));
      }
      if (absent && field.fallback.empty()) continue;
      const YAML::Node given = absent ? YAML::Load(field.fallback) : it->second;
      auto checked = value(given, field, inner_path, label);
      if (!checked) return checked.error();
      filled[field.key] = *checked;
    }
    return filled;
  }

 private:
  Result<YAML::Node> value(const YAML::Node& node, const Field& field, const std::string& path,
                           const std::string& label) {
    const auto complain = [&](const YAML::Node& place, const std::string& more = "") {
      return wrong(place, path,
                   fmt::format("'{}' of {} is {}; expected {}{}", field.key, label, shown(place),
                               expected(field), more));
    };
    switch (field.kind) {
      case ValueKind::kText: {
        if (!node.IsScalar()) return complain(node);
        const std::string text = node.Scalar();
        if (!field.allowed.empty() &&
            std::find(field.allowed.begin(), field.allowed.end(), text) == field.allowed.end()) {
          const std::string near = nearest_word(text, field.allowed);
          return complain(node, near.empty() ? "" : fmt::format("; did you mean '{}'?", near));
        }
        if (auto bad = broken_rule(node, field, path, label)) return *bad;
        return node;
      }
      case ValueKind::kFlag: {
        bool flag = false;
        if (!node.IsScalar() || !YAML::convert<bool>::decode(node, flag)) return complain(node);
        return YAML::Node(flag);
      }
      case ValueKind::kInteger: {
        long long whole = 0;
        if (!node.IsScalar() || !YAML::convert<long long>::decode(node, whole)) return complain(node);
        if (static_cast<double>(whole) < field.min || static_cast<double>(whole) > field.max)
          return complain(node);
        return YAML::Node(whole);
      }
      case ValueKind::kNumber: {
        double number = 0;
        if (!node.IsScalar() || !YAML::convert<double>::decode(node, number) || !std::isfinite(number))
          return complain(node);
        if (number < field.min || number > field.max) return complain(node);
        return node;
      }
      case ValueKind::kNumberOrMax: {
        if (!node.IsScalar()) return complain(node);
        if (node.Scalar() == "max") return node;
        double number = 0;
        if (!YAML::convert<double>::decode(node, number) || !std::isfinite(number) || number <= 0)
          return complain(node);
        return node;
      }
      case ValueKind::kTextList: {
        if (!node.IsSequence()) return complain(node);
        for (const auto& item : node) {
          if (!item.IsScalar()) return complain(item);
          if (auto bad = broken_rule(item, field, path, label)) return *bad;
        }
        return node;
      }
      case ValueKind::kTextMap: {
        if (!node.IsMap()) return complain(node);
        for (const auto& item : node) {
          if (!item.second.IsScalar()) return complain(item.second);
        }
        return node;
      }
      case ValueKind::kAnyMap:
        if (!node.IsMap()) return complain(node);
        return node;
      case ValueKind::kMap:
        return map(node, *field.inner, path, field.inner->what);
      case ValueKind::kList:
        return list(node, field, path, complain);
    }
    return complain(node);
  }

  Result<YAML::Node> list(const YAML::Node& node, const Field& field, const std::string& path,
                          const std::function<Error(const YAML::Node&, const std::string&)>& complain) {
    if (!node.IsSequence()) return complain(node, "");
    const Schema& inner = *field.inner;
    YAML::Node filled(YAML::NodeType::Sequence);
    std::map<std::string, int> lines;
    std::size_t index = 0;
    for (const auto& item : node) {
      ++index;
      std::string label = fmt::format("{} {}", inner.what, index);
      std::string item_path = fmt::format("{}.{}", path, index);
      if (!inner.name_key.empty() && item.IsMap()) {
        const YAML::Node name = item[inner.name_key];
        if (name && name.IsScalar()) {
          label = fmt::format("{} '{}'", inner.what, name.Scalar());
          item_path = path + "." + name.Scalar();
          if (const auto before = lines.find(name.Scalar()); before != lines.end()) {
            return wrong(name, item_path,
                         fmt::format("there are two {}s named '{}', the first in line {}", inner.what,
                                     name.Scalar(), before->second));
          }
          lines[name.Scalar()] = name.Mark().line + 1;
        }
      }
      auto checked = map(item, inner, item_path, label);
      if (!checked) return checked.error();
      filled.push_back(*checked);
    }
    return filled;
  }

  std::optional<Error> broken_rule(const YAML::Node& node, const Field& field, const std::string& path,
                                   const std::string& label) {
    if (!field.rule) return std::nullopt;
    const std::string complaint = field.rule(node.Scalar());
    if (complaint.empty()) return std::nullopt;
    return wrong(node, path, fmt::format("'{}' of {} is {}; {}", field.key, label, shown(node), complaint));
  }

  // A value that came from the command line has no line: name the option instead.
  Error wrong(const YAML::Node& node, const std::string& path, const std::string& sentence) {
    for (const auto& override_ : overrides_) {
      if (path == override_.path || path.starts_with(override_.path + ".")) {
        return {ErrorCode::kInvalidArgument, override_.origin + ": " + sentence};
      }
    }
    const YAML::Mark mark = node.Mark();
    if (mark.is_null()) return {ErrorCode::kInvalidArgument, file_ + ": " + sentence};
    return {ErrorCode::kInvalidArgument, fmt::format("{}:{}: {}", file_, mark.line + 1, sentence)};
  }

  std::string file_;
  const std::vector<Override>& overrides_;
};

std::vector<std::string> split_path(const std::string& path) {
  std::vector<std::string> parts(1);
  for (const char c : path) {
    if (c == '.') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

}  // namespace

Result<YAML::Node> read_yaml(const std::string& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return Error{ErrorCode::kNotFound, fmt::format("there is no file {}", file)};
  }
  try {
    YAML::Node node = YAML::LoadFile(file);
    if (!node || node.IsNull()) return Error{ErrorCode::kInvalidArgument, file + ": the file is empty"};
    return node;
  } catch (const YAML::BadFile&) {
    return Error{ErrorCode::kNotFound, fmt::format("the file {} cannot be read", file)};
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("{}:{}: this is no YAML: {}", file, e.mark.line + 1, e.msg)};
  }
}

Status apply_override(YAML::Node& document, const Schema& schema, const Override& override_) {
  const auto parts = split_path(override_.path);
  YAML::Node node = document;
  const Schema* here = &schema;
  const Schema* items = nullptr;  // set while `node` is a list of such items
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool last = i + 1 == parts.size();
    if (parts[i].empty()) {
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("{}: the key '{}' has an empty part", override_.origin, override_.path)};
    }
    if (items != nullptr) {
      std::vector<std::string> names;
      YAML::Node match;
      for (auto item : node) {
        const YAML::Node name = item.IsMap() ? item[items->name_key] : YAML::Node();
        if (!name || !name.IsScalar()) continue;
        names.push_back(name.Scalar());
        if (name.Scalar() == parts[i]) match.reset(item);
      }
      if (!match.IsMap() || last) {
        const std::string near = nearest_word(parts[i], names);
        return Error{
            ErrorCode::kInvalidArgument,
            last && match.IsMap()
                ? fmt::format("{}: '{}' is a whole {}: name one of its keys: {}", override_.origin,
                              override_.path, items->what, join_words(keys_of(*items)))
                : fmt::format("{}: there is no {} '{}'{}; there are: {}", override_.origin, items->what,
                              parts[i], near.empty() ? "" : fmt::format("; did you mean '{}'?", near),
                              join_words(names))};
      }
      node.reset(match);
      here = items;
      items = nullptr;
      continue;
    }
    const Field* field = here == nullptr ? nullptr : find_field(*here, parts[i]);
    if (last) {
      node[parts[i]] = override_.value;
      return {};
    }
    YAML::Node child = node[parts[i]];
    if (!child.IsDefined() || child.IsNull()) {
      node[parts[i]] = YAML::Node(YAML::NodeType::Map);
      child.reset(node[parts[i]]);
    }
    const bool is_list =
        field != nullptr && field->kind == ValueKind::kList && !field->inner->name_key.empty();
    if (is_list ? !child.IsSequence() : !child.IsMap()) {
      return Error{ErrorCode::kInvalidArgument, fmt::format("{}: '{}' is {}, which has no keys inside",
                                                            override_.origin, parts[i], shown(child))};
    }
    if (is_list) items = field->inner;
    here = field != nullptr && field->kind == ValueKind::kMap ? field->inner : nullptr;
    node.reset(child);
  }
  return {};
}

Result<YAML::Node> check_document(const YAML::Node& document, const Schema& schema, const std::string& file,
                                  const std::vector<Override>& overrides) {
  return Checker(file, overrides).map(document, schema, "", "the " + schema.what);
}

std::string describe(const Schema& schema) {
  std::string text = fmt::format("{}:\n", schema.what);
  std::string inner;
  for (const auto& field : schema.fields) {
    text += fmt::format("  {:<16} {}; {}{}\n", field.key, field.meaning, expected(field),
                        field.required           ? "; required"
                        : field.fallback.empty() ? ""
                                                 : "; default " + field.fallback);
    if (field.inner != nullptr) inner += describe(*field.inner);
  }
  return text + inner;
}

}  // namespace nido
