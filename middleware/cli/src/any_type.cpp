#include "nido/cli/any_type.h"

#include <array>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <limits>
#include <type_traits>

#include "nido/launcher/suggest.h"
#include "nido/middleware/typed_port.h"
#include "nido/msgs/reflection.h"
#include "nido/value/value_message.h"

namespace nido {
namespace {

template <class T>
struct IsVector : std::false_type {};
template <class T>
struct IsVector<std::vector<T>> : std::true_type {};
template <class T>
struct IsArray : std::false_type {};
template <class T, std::size_t N>
struct IsArray<std::array<T, N>> : std::true_type {};

template <class T>
Json json_of(const T& value, std::size_t longest);

template <class List>
Json json_of_list(const List& list, std::size_t longest) {
  const bool cut = longest > 0 && list.size() > longest;
  Json items = Json::array();
  for (std::size_t i = 0; i < (cut ? std::min<std::size_t>(longest, 4) : list.size()); ++i) {
    const typename List::value_type item = list[i];
    items.push_back(json_of(item, longest));
  }
  if (!cut) return items;
  return Json{{"length", list.size()}, {"first", items}};
}

template <class T>
Json json_of(const T& value, std::size_t longest) {
  if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
    return value;
  } else if constexpr (IsVector<T>::value || IsArray<T>::value) {
    return json_of_list(value, longest);
  } else {
    Json object = Json::object();
    msgs::visit_fields(value,
                       [&](const char* name, const auto& field) { object[name] = json_of(field, longest); });
    return object;
  }
}

std::string shown(const Json& value) {
  const std::string text = value.dump();
  return text.size() > 60 ? text.substr(0, 57) + "..." : text;
}

Error wrong(const std::string& path, const Json& value, const std::string& expected) {
  return {ErrorCode::kInvalidArgument, "'" + path + "' is " + shown(value) + "; expected " + expected};
}

template <class T>
Status read_json(const Json& value, T& target, const std::string& path);

template <class T>
Status read_number(const Json& value, T& target, const std::string& path) {
  if constexpr (std::is_same_v<T, bool>) {
    if (!value.is_boolean()) return wrong(path, value, "true or false");
    target = value.get<bool>();
  } else if constexpr (std::is_floating_point_v<T>) {
    if (!value.is_number()) return wrong(path, value, "a number");
    target = value.get<T>();
  } else {
    const std::string range = "a whole number from " + std::to_string(+std::numeric_limits<T>::min()) +
                              " to " + std::to_string(+std::numeric_limits<T>::max());
    if (value.is_number_unsigned()) {
      const auto whole = value.get<std::uint64_t>();
      if (whole > static_cast<std::uint64_t>(std::numeric_limits<T>::max())) return wrong(path, value, range);
      target = static_cast<T>(whole);
    } else if (value.is_number_integer()) {
      const auto whole = value.get<std::int64_t>();
      if (whole < 0 &&
          (std::is_unsigned_v<T> || whole < static_cast<std::int64_t>(std::numeric_limits<T>::min()))) {
        return wrong(path, value, range);
      }
      target = static_cast<T>(whole);
    } else {
      return wrong(path, value, range);
    }
  }
  return {};
}

template <class T>
Status read_json(const Json& value, T& target, const std::string& path) {
  if constexpr (std::is_arithmetic_v<T>) {
    return read_number(value, target, path);
  } else if constexpr (std::is_same_v<T, std::string>) {
    if (!value.is_string()) return wrong(path, value, "text");
    target = value.get<std::string>();
    return {};
  } else if constexpr (IsVector<T>::value) {
    if (!value.is_array()) return wrong(path, value, "a list");
    target.clear();
    for (std::size_t i = 0; i < value.size(); ++i) {
      typename T::value_type item{};
      if (auto status = read_json(value[i], item, path + "." + std::to_string(i)); !status) return status;
      target.push_back(item);
    }
    return {};
  } else if constexpr (IsArray<T>::value) {
    if (!value.is_array() || value.size() != target.size()) {
      return wrong(path, value, "a list of " + std::to_string(target.size()));
    }
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (auto status = read_json(value[i], target[i], path + "." + std::to_string(i)); !status)
        return status;
    }
    return {};
  } else {
    std::vector<std::string> names;
    msgs::visit_fields(target, [&](const char* name, auto&) { names.emplace_back(name); });
    if (!value.is_object()) return wrong(path, value, "a map with the fields " + join_words(names));
    for (const auto& [key, unused] : value.items()) {
      if (std::find(names.begin(), names.end(), key) != names.end()) continue;
      const std::string near = nearest_word(key, names);
      return Error{ErrorCode::kInvalidArgument, (path.empty() ? "" : "'" + path + "': ") +
                                                    "there is no field '" + key + "'" +
                                                    (near.empty() ? "" : "; did you mean '" + near + "'?") +
                                                    "; allowed: " + join_words(names)};
    }
    Status status;
    msgs::visit_fields(target, [&](const char* name, auto& field) {
      if (status && value.contains(name))
        status = read_json(value[name], field, path.empty() ? name : path + "." + name);
    });
    return status;
  }
}

template <class T>
AnyType make_any_type() {
  AnyType any;
  any.type = message_type_of<T>();
  any.name = any.type.ros_name();
  any.to_json = [](const void* message, std::size_t longest) {
    return json_of(*static_cast<const T*>(message), longest);
  };
  any.from_json = [](const Json& value, void* message) {
    return read_json(value, *static_cast<T*>(message), "");
  };
  T empty;
  msgs::visit_fields(empty, [&any](const char* name, auto&) { any.fields.emplace_back(name); });
  any.wire_size = [](void* message) -> std::size_t {
    typename msgs::TypeSupportOf<T>::type support;
    return support.getSerializedSizeProvider(message)();
  };
  return any;
}

// A list of anything is shown, and written, as the text that people use for it.
AnyType type_of_values() {
  AnyType any = make_any_type<msgs::Values>();
  any.fields = {"header", "text"};
  any.to_json = [](const void* message, std::size_t longest) {
    const auto& list = *static_cast<const msgs::Values*>(message);
    const Result<Values> values = values_of(list);
    return Json{{"header", json_of(list.header(), longest)},
                {"text", values ? to_text(*values) : "(no list: " + values.error().message + ")"}};
  };
  any.from_json = [](const Json& value, void* message) -> Status {
    auto& list = *static_cast<msgs::Values*>(message);
    if (!value.is_object()) return wrong("", value, "a map with the fields header, text");
    for (const auto& [key, inner] : value.items()) {
      if (key == "header") {
        if (Status read = read_json(inner, list.header(), "header"); !read) return read;
      } else if (key == "text" && inner.is_string()) {
        const Result<Values> values = parse_values(inner.get<std::string>());
        if (!values) return values.error();
        list.data() = message_of(*values).data();
      } else {
        return wrong(key, inner, "one of header, text (a list of anything, as in: seen 3 (1.5 \"a b\"))");
      }
    }
    return {};
  };
  return any;
}

}  // namespace

const std::vector<AnyType>& any_types() {
  static const std::vector<AnyType> types = [] {
    std::vector<AnyType> all = {
#define NIDO_ANY_TYPE(package, folder, type) make_any_type<package::folder::dds_::type##_>(),
        NIDO_MSGS(NIDO_ANY_TYPE)
#undef NIDO_ANY_TYPE
    };
    for (AnyType& type : all) {
      if (type.name == "nido_msgs/msg/Values") type = type_of_values();
    }
    return all;
  }();
  return types;
}

const AnyType* find_any_type(const std::string& name) {
  for (const auto& type : any_types()) {
    if (type.name == name || type.type.dds_name == name) return &type;
  }
  return nullptr;
}

}  // namespace nido
