#include <fmt/format.h>

#include <algorithm>

#include "nido/value/bytes.h"
#include "nido/value/value.h"

namespace nido {
namespace {

using Kind = Value::Kind;

constexpr std::int32_t kListCode = 256;
constexpr std::int32_t kDictCode = 512;

// codes of the values; floating-point numbers and long words depend on the dialect
std::int32_t code_of(const Value& value, Dialect dialect) {
  switch (value.kind) {
    case Kind::kInt8:
      return 32;
    case Kind::kInt16:
      return 64;
    case Kind::kInt32:
      return 1;
    case Kind::kInt64:
      return 17;
    case Kind::kFloat32:
      return dialect == Dialect::k3 ? 128 : 10;
    case Kind::kFloat64:
      return dialect == Dialect::k3 ? 10 : 20;
    case Kind::kWord:
      // 3.x knows four letters only: longer words become strings there
      return value.text.size() <= 4 ? 9 : dialect == Dialect::k4 ? 18 : 4;
    case Kind::kString:
      return 4;
    case Kind::kBlob:
      return 12;
    case Kind::kList:
      return kListCode;
    case Kind::kDict:
      return kListCode | kDictCode;
  }
  return kListCode;
}

std::int32_t shared_code(const std::vector<Value>& items, Dialect dialect) {
  if (items.empty()) return 0;
  const std::int32_t first = code_of(items.front(), dialect);
  // lists in lists carry a tag of their own each
  if ((first & kListCode) != 0) return 0;
  const bool same = std::all_of(items.begin(), items.end(),
                                [&](const Value& item) { return code_of(item, dialect) == first; });
  return same ? first : 0;
}

void put_list(std::string& out, const std::vector<Value>& items, Dialect dialect);

void put_body(std::string& out, const Value& value, Dialect dialect) {
  switch (value.kind) {
    case Kind::kInt8:
      return put(out, static_cast<std::int8_t>(value.integer));
    case Kind::kInt16:
      return put(out, static_cast<std::int16_t>(value.integer));
    case Kind::kInt32:
      return put(out, static_cast<std::int32_t>(value.integer));
    case Kind::kInt64:
      return put(out, value.integer);
    case Kind::kFloat32:
      return put(out, static_cast<float>(value.number));
    case Kind::kFloat64:
      return put(out, value.number);
    case Kind::kWord: {
      const std::size_t size = value.text.size();
      if (size > 4 && dialect == Dialect::k3) break;
      char letters[8] = {};
      std::memcpy(letters, value.text.data(), std::min<std::size_t>(size, 8));
      out.append(letters, size > 4 ? 8 : 4);
      return;
    }
    case Kind::kString:
    case Kind::kBlob:
      break;
    case Kind::kList: {
      // the code that stood before is that of the list; its own items follow without a second tag
      put(out, static_cast<std::int32_t>(value.items.size()));
      const std::int32_t shared = shared_code(value.items, dialect);
      for (const Value& item : value.items) {
        if (shared == 0)
          put(out, item.kind == Kind::kList ? kListCode | shared_code(item.items, dialect)
                                            : code_of(item, dialect));
        put_body(out, item, dialect);
      }
      return;
    }
    case Kind::kDict:
      return put_list(out, value.items, dialect);
  }
  put(out, static_cast<std::int32_t>(value.text.size()));
  out += value.text;
}

void put_list(std::string& out, const std::vector<Value>& items, Dialect dialect) {
  put(out, kListCode | shared_code(items, dialect));
  const Value whole = Value::list(items);
  put_body(out, whole, dialect);
}

class Reader {
 public:
  Reader(std::string_view bytes, Dialect dialect, const ValueLimits& limits)
      : bytes_(bytes), dialect_(dialect), limits_(limits) {}

  Result<Values> read_all() {
    Result<Values> values = read_tagged(0);
    if (values && at_ != bytes_.size())
      return wrong(fmt::format("{} bytes are left over", bytes_.size() - at_));
    return values;
  }

 private:
  Error wrong(const std::string& what) const {
    return {ErrorCode::kInvalidArgument, fmt::format("byte {} of a list: {}", at_, what)};
  }
  template <class T>
  bool read(T& value) {
    if (bytes_.size() - at_ < sizeof(T)) return false;
    value = get_at<T>(bytes_, at_);
    at_ += sizeof(T);
    return true;
  }

  Result<Values> read_tagged(int depth) {
    std::int32_t tag = 0;
    if (!read(tag)) return wrong("it ends before its tag");
    if ((tag & kListCode) == 0 || (tag & kDictCode) != 0)
      return wrong(fmt::format("{} is no tag of a list", tag));
    return read_items(tag & ~kListCode, depth);
  }

  // `shared`: the code of every item, 0 when each has its own
  Result<Values> read_items(std::int32_t shared, int depth) {
    if (depth > limits_.depth) return wrong(fmt::format("lists are nested deeper than {}", limits_.depth));
    std::int32_t count = 0;
    if (!read(count)) return wrong("it ends before the count of a list");
    // a value takes at least one byte, so that a count beyond what is there is a lie
    if (count < 0 || static_cast<std::size_t>(count) > bytes_.size() - at_) {
      return wrong(fmt::format("a list of {} values does not fit into {} bytes", count, bytes_.size() - at_));
    }
    values_ += static_cast<std::size_t>(count);
    if (values_ > limits_.values) return wrong(fmt::format("more than {} values", limits_.values));
    Values items;
    items.reserve(std::min<std::size_t>(static_cast<std::size_t>(count), 1024));
    for (std::int32_t i = 0; i < count; ++i) {
      std::int32_t code = shared;
      if (code == 0 && !read(code)) return wrong("it ends before the code of a value");
      Result<Value> item = read_body(code, depth);
      if (!item) return item.error();
      items.push_back(std::move(*item));
    }
    return items;
  }

  template <class T>
  Result<Value> whole(Kind kind) {
    T number{};
    if (!read(number)) return wrong("it ends within a number");
    Value value;
    value.kind = kind;
    value.integer = number;
    return value;
  }
  template <class T>
  Result<Value> floating(Kind kind) {
    T number{};
    if (!read(number)) return wrong("it ends within a number");
    Value value;
    value.kind = kind;
    value.number = static_cast<double>(number);
    return value;
  }
  Result<Value> word(std::size_t letters) {
    if (bytes_.size() - at_ < letters) return wrong("it ends within a word");
    std::string_view text = bytes_.substr(at_, letters);
    at_ += letters;
    text = text.substr(0, std::min(text.size(), text.find_last_not_of('\0') + 1));
    Value value;
    value.kind = Kind::kWord;
    value.text = text;
    return value;
  }
  Result<Value> bytes(Kind kind) {
    std::int32_t size = 0;
    if (!read(size)) return wrong("it ends before the length of a text");
    if (size < 0 || static_cast<std::size_t>(size) > bytes_.size() - at_) {
      return wrong(fmt::format("a text of {} bytes does not fit into {}", size, bytes_.size() - at_));
    }
    Value value;
    value.kind = kind;
    value.text = bytes_.substr(at_, static_cast<std::size_t>(size));
    at_ += static_cast<std::size_t>(size);
    return value;
  }

  Result<Value> read_body(std::int32_t code, int depth) {
    const bool is_4 = dialect_ == Dialect::k4;
    switch (code) {
      case 32:
        return whole<std::int8_t>(Kind::kInt8);
      case 64:
        return whole<std::int16_t>(Kind::kInt16);
      case 1:
        return whole<std::int32_t>(Kind::kInt32);
      case 17:
        return whole<std::int64_t>(Kind::kInt64);
      case 128:
        if (!is_4) return floating<float>(Kind::kFloat32);
        break;
      case 10:
        return is_4 ? floating<float>(Kind::kFloat32) : floating<double>(Kind::kFloat64);
      case 20:
        if (is_4) return floating<double>(Kind::kFloat64);
        break;
      case 9:
        return word(4);
      case 18:
        if (is_4) return word(8);
        break;
      case 4:
        return bytes(Kind::kString);
      case 12:
        return bytes(Kind::kBlob);
      default:
        break;
    }
    if (code == (kListCode | kDictCode)) {
      Result<Values> items = read_tagged(depth + 1);
      if (!items) return items.error();
      Value value;
      value.kind = Kind::kDict;
      value.items = std::move(*items);
      return value;
    }
    if ((code & kListCode) != 0 && (code & kDictCode) == 0) {
      Result<Values> items = read_items(code & ~kListCode, depth + 1);
      if (!items) return items.error();
      return Value::list(std::move(*items));
    }
    return wrong(fmt::format("{} is no code of a value", code));
  }

  std::string_view bytes_;
  Dialect dialect_;
  ValueLimits limits_;
  std::size_t at_ = 0;
  std::size_t values_ = 0;
};

}  // namespace

Value Value::of(std::int64_t whole) {
  Value value;
  value.kind = whole >= INT32_MIN && whole <= INT32_MAX ? Kind::kInt32 : Kind::kInt64;
  value.integer = whole;
  return value;
}

Value Value::of(double number) {
  Value value;
  value.kind = Kind::kFloat64;
  value.number = number;
  return value;
}

Value Value::word(std::string_view letters) {
  Value value;
  value.kind = Kind::kWord;
  value.text = letters.substr(0, 8);
  return value;
}

Value Value::string(std::string text) {
  Value value;
  value.kind = Kind::kString;
  value.text = std::move(text);
  return value;
}

Value Value::blob(std::string bytes) {
  Value value;
  value.kind = Kind::kBlob;
  value.text = std::move(bytes);
  return value;
}

Value Value::list(std::vector<Value> items) {
  Value value;
  value.items = std::move(items);
  return value;
}

std::string encode(const Values& values, Dialect dialect) {
  std::string out;
  put_list(out, values, dialect);
  return out;
}

Result<Values> decode(std::string_view bytes, Dialect dialect, const ValueLimits& limits) {
  return Reader(bytes, dialect, limits).read_all();
}

Values list_of_numbers(const std::vector<double>& numbers) {
  Values values;
  values.reserve(numbers.size());
  for (const double number : numbers) values.push_back(Value::of(number));
  return values;
}

}  // namespace nido
