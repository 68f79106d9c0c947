#include "nido/cli/idl_type.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include "nido/launcher/suggest.h"
#include "nido/recorder/raw_message.h"

namespace nido {
namespace {

using Kind = IdlType::Kind;

// little-endian CDR, as this computer has it
constexpr std::string_view kHeader("\0\1\0\0", 4);
static_assert(std::endian::native == std::endian::little, "CDR is written as this computer has it");

// Calls `use` with a number of the C++ type that a basic kind is.
template <class Use>
auto with_number(Kind kind, const Use& use) {
  switch (kind) {
    case Kind::kInt8:
      return use(std::int8_t{});
    case Kind::kUint8:
    case Kind::kBool:
      return use(std::uint8_t{});
    case Kind::kInt16:
      return use(std::int16_t{});
    case Kind::kUint16:
      return use(std::uint16_t{});
    case Kind::kInt32:
      return use(std::int32_t{});
    case Kind::kInt64:
      return use(std::int64_t{});
    case Kind::kUint64:
      return use(std::uint64_t{});
    case Kind::kFloat:
      return use(float{});
    case Kind::kDouble:
      return use(double{});
    default:  // kUint32, kEnum
      return use(std::uint32_t{});
  }
}

class CdrReader {
 public:
  explicit CdrReader(std::string_view bytes) : bytes_(bytes) {}

  Result<Json> read_all(const IdlType& type, std::size_t longest) {
    if (bytes_.size() < 4) return wrong("it ends before its header");
    const int kind = static_cast<unsigned char>(bytes_[1]);
    if (bytes_[0] != 0 || (kind != 0 && kind != 1 && kind != 6 && kind != 7)) {
      return wrong(fmt::format("representation {:02x}{:02x} is neither CDR nor plain CDR2",
                               static_cast<unsigned char>(bytes_[0]), kind));
    }
    is_swapped_ = kind % 2 == 0;
    widest_ = kind >= 6 ? 4 : 8;
    bytes_.remove_prefix(4);
    longest_ = longest;
    return read(type);
  }

 private:
  [[nodiscard]] Error wrong(const std::string& what) const {
    return {ErrorCode::kInvalidArgument, fmt::format("byte {} of the message: {}", at_, what)};
  }

  template <class T>
  bool number(T& value) {
    const std::size_t align = std::min(sizeof(T), widest_);
    at_ = (at_ + align - 1) / align * align;
    if (at_ > bytes_.size() || bytes_.size() - at_ < sizeof(T)) return false;
    char raw[sizeof(T)];
    std::memcpy(raw, bytes_.data() + at_, sizeof(T));
    if (is_swapped_) std::reverse(raw, raw + sizeof(T));
    std::memcpy(&value, raw, sizeof(T));
    at_ += sizeof(T);
    return true;
  }

  Result<Json> read(const IdlType& type) {
    switch (type.kind) {
      case Kind::kStruct: {
        Json object = Json::object();
        for (const auto& field : type.fields) {
          Result<Json> value = read(*field.type);
          if (!value) return value;
          object[field.name] = std::move(*value);
        }
        return object;
      }
      case Kind::kString:
        return read_string();
      case Kind::kSequence: {
        std::uint32_t count = 0;
        if (!number(count)) return wrong("it ends before the length of a sequence");
        // every item takes a byte at least
        if (count > bytes_.size() - at_) {
          return wrong(fmt::format("{} items do not fit into {} bytes", count, bytes_.size() - at_));
        }
        return read_items(*type.item, count);
      }
      case Kind::kArray:
        return read_items(*type.item, type.size);
      default:
        return with_number(type.kind, [&](auto value) -> Result<Json> {
          if (!number(value)) return wrong("it ends within a number");
          if (type.kind == Kind::kBool) return Json(value != 0);
          if (type.kind == Kind::kEnum && static_cast<std::size_t>(value) < type.words.size()) {
            return Json(type.words[static_cast<std::size_t>(value)]);
          }
          return Json(value);
        });
    }
  }

  Result<Json> read_string() {
    std::uint32_t size = 0;
    if (!number(size)) return wrong("it ends before the length of a text");
    if (size == 0) return Json("");
    if (size > bytes_.size() - at_) {
      return wrong(fmt::format("a text of {} bytes does not fit into {}", size, bytes_.size() - at_));
    }
    std::string text(bytes_.substr(at_, size - 1));
    at_ += size;
    return Json(std::move(text));
  }

  Result<Json> read_items(const IdlType& item, std::size_t count) {
    const bool is_cut = longest_ > 0 && count > longest_;
    Json items = Json::array();
    for (std::size_t i = 0; i < count; ++i) {
      Result<Json> value = read(item);
      if (!value) return value;
      if (!is_cut || i < 4) items.push_back(std::move(*value));
    }
    if (!is_cut) return items;
    return Json{{"length", count}, {"first", std::move(items)}};
  }

  std::string_view bytes_;
  std::size_t at_ = 0;  // behind the header: what things are aligned to
  std::size_t widest_ = 8;
  bool is_swapped_ = false;
  std::size_t longest_ = 0;
};

class CdrWriter {
 public:
  Result<std::string> write_all(const IdlType& type, const Json& value) {
    if (Status written = write(type, &value, ""); !written) return written.error();
    return std::string(kHeader) + out_;
  }

 private:
  static Error wrong(const std::string& path, const Json& value, const std::string& expected) {
    const std::string shown = value.dump(-1, ' ', false, Json::error_handler_t::replace);
    return {ErrorCode::kInvalidArgument,
            fmt::format("'{}' is {}; expected {}", path,
                        shown.size() > 60 ? shown.substr(0, 57) + "..." : shown, expected)};
  }

  template <class T>
  void number(T value) {
    out_.resize((out_.size() + sizeof(T) - 1) / sizeof(T) * sizeof(T), '\0');
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    out_.append(raw, sizeof(T));
  }

  // value: nullptr for a field that is not named
  Status write(const IdlType& type, const Json* value, const std::string& path) {
    switch (type.kind) {
      case Kind::kStruct:
        return write_struct(type, value, path);
      case Kind::kString: {
        if (value != nullptr && !value->is_string()) return wrong(path, *value, "text");
        const std::string text = value == nullptr ? "" : value->get<std::string>();
        if (type.size > 0 && text.size() > type.size) {
          return wrong(path, *value, fmt::format("at most {} bytes", type.size));
        }
        number(static_cast<std::uint32_t>(text.size() + 1));
        out_ += text;
        out_ += '\0';
        return {};
      }
      case Kind::kSequence: {
        if (value != nullptr && !value->is_array()) return wrong(path, *value, "a list");
        const std::size_t count = value == nullptr ? 0 : value->size();
        if (type.size > 0 && count > type.size) {
          return wrong(path, *value, fmt::format("at most {} items", type.size));
        }
        number(static_cast<std::uint32_t>(count));
        return write_items(*type.item, value, count, path);
      }
      case Kind::kArray:
        if (value != nullptr && (!value->is_array() || value->size() != type.size)) {
          return wrong(path, *value, fmt::format("a list of {}", type.size));
        }
        return write_items(*type.item, value, type.size, path);
      default:
        return write_number(type, value, path);
    }
  }

  Status write_struct(const IdlType& type, const Json* value, const std::string& path) {
    if (value != nullptr) {
      std::vector<std::string> names;
      for (const auto& field : type.fields) names.push_back(field.name);
      if (!value->is_object()) return wrong(path, *value, "a map with the fields " + join_words(names));
      for (const auto& [key, unused] : value->items()) {
        if (std::find(names.begin(), names.end(), key) != names.end()) continue;
        const std::string near = nearest_word(key, names);
        return Error{ErrorCode::kInvalidArgument,
                     fmt::format("{}there is no field '{}'{}; allowed: {}",
                                 path.empty() ? "" : "'" + path + "': ", key,
                                 near.empty() ? "" : "; did you mean '" + near + "'?", join_words(names))};
      }
    }
    for (const auto& field : type.fields) {
      const Json* inner = value != nullptr && value->contains(field.name) ? &(*value)[field.name] : nullptr;
      if (Status written = write(*field.type, inner, path.empty() ? field.name : path + "." + field.name);
          !written) {
        return written;
      }
    }
    return {};
  }

  Status write_items(const IdlType& item, const Json* value, std::size_t count, const std::string& path) {
    for (std::size_t i = 0; i < count; ++i) {
      if (Status written =
              write(item, value == nullptr ? nullptr : &(*value)[i], fmt::format("{}.{}", path, i));
          !written) {
        return written;
      }
    }
    return {};
  }

  Status write_number(const IdlType& type, const Json* value, const std::string& path) {
    if (type.kind == Kind::kBool) {
      if (value != nullptr && !value->is_boolean()) return wrong(path, *value, "true or false");
      number(static_cast<std::uint8_t>(value != nullptr && value->get<bool>() ? 1 : 0));
      return {};
    }
    if (type.kind == Kind::kEnum && value != nullptr && value->is_string()) {
      const auto word = std::find(type.words.begin(), type.words.end(), value->get<std::string>());
      if (word == type.words.end()) return wrong(path, *value, "one of " + join_words(type.words));
      number(static_cast<std::uint32_t>(word - type.words.begin()));
      return {};
    }
    return with_number(type.kind, [&](auto out) -> Status {
      using T = decltype(out);
      if (value != nullptr) {
        if constexpr (std::is_floating_point_v<T>) {
          if (!value->is_number()) return wrong(path, *value, "a number");
          out = value->get<T>();
        } else {
          const std::string range = fmt::format(
              "a whole number from {} to {}", +std::numeric_limits<T>::min(), +std::numeric_limits<T>::max());
          if (!value->is_number_integer()) return wrong(path, *value, range);
          const bool fits = value->is_number_unsigned() ? std::in_range<T>(value->get<std::uint64_t>())
                                                        : std::in_range<T>(value->get<std::int64_t>());
          if (!fits) return wrong(path, *value, range);
          out = value->get<T>();
        }
      }
      number(out);
      return {};
    });
  }

  std::string out_;  // behind the header
};

}  // namespace

Result<Json> json_of_cdr(const IdlType& type, std::string_view bytes, std::size_t longest) {
  return CdrReader(bytes).read_all(type, longest);
}

Result<std::string> cdr_of_json(const IdlType& type, const Json& value) {
  return CdrWriter().write_all(type, value);
}

std::shared_ptr<const AnyType> IdlTypes::find(const std::string& ros_name) const {
  const std::shared_ptr<const IdlType> type = definition(ros_name);
  if (type == nullptr) return nullptr;
  auto any = std::make_shared<AnyType>();
  any->name = ros_name;
  any->type = raw_message_type(ros_name);
  any->to_json = [type](const void* message, std::size_t longest) {
    const auto json = json_of_cdr(*type, static_cast<const RawMessage*>(message)->bytes(), longest);
    return json ? *json : Json{{"type", type->name}, {"error", json.error().message}};
  };
  any->from_json = [type](const Json& value, void* message) -> Status {
    const auto bytes = cdr_of_json(*type, value);
    if (!bytes) return bytes.error();
    static_cast<RawMessage*>(message)->arrive(*bytes, nullptr);
    return {};
  };
  for (const auto& field : type->fields) any->fields.push_back(field.name);
  any->wire_size = [](void* message) { return static_cast<const RawMessage*>(message)->bytes().size(); };
  return any;
}

}  // namespace nido
