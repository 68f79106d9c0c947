#include <fmt/format.h>

#include <cctype>
#include <charconv>
#include <optional>

#include "nido/cli/idl_type.h"

namespace nido {
namespace {

using Kind = IdlType::Kind;
using Type = std::shared_ptr<const IdlType>;

constexpr int kDeepest = 32;                    // modules in modules, sequences in sequences
constexpr std::size_t kLargestArray = 1 << 28;  // bytes, of all dimensions together

struct Token {
  std::string text;
  int line = 0;
};

// Words, numbers and signs; comments and preprocessor lines are left out.
std::vector<Token> tokens_of(std::string_view text) {
  std::vector<Token> tokens;
  int line = 1;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    const auto rest = text.substr(at);
    if (c == '\n') {
      ++line;
      ++at;
    } else if (std::isspace(static_cast<unsigned char>(c)) != 0) {
      ++at;
    } else if (rest.starts_with("//") || c == '#') {
      at = std::min(text.find('\n', at), text.size());
    } else if (rest.starts_with("/*")) {
      const std::size_t end = std::min(text.find("*/", at + 2), text.size());
      for (; at < end; ++at) line += text[at] == '\n' ? 1 : 0;
      at = std::min(end + 2, text.size());
    } else if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_') {
      std::size_t end = at;
      while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) != 0 ||
                                   text[end] == '_' || text[end] == '.')) {
        ++end;
      }
      tokens.push_back({std::string(text.substr(at, end - at)), line});
      at = end;
    } else if (c == '"') {
      std::size_t end = at + 1;
      while (end < text.size() && text[end] != '"' && text[end] != '\n') end += text[end] == '\\' ? 2 : 1;
      end = std::min(end + 1, text.size());
      tokens.push_back({std::string(text.substr(at, end - at)), line});
      at = end;
    } else {
      const std::size_t size = rest.starts_with("::") ? 2 : 1;
      tokens.push_back({std::string(rest.substr(0, size)), line});
      at += size;
    }
  }
  tokens.push_back({"", line});
  return tokens;
}

const std::map<std::string, Kind>& basic_types() {
  static const std::map<std::string, Kind> types = {
      {"boolean", Kind::kBool}, {"octet", Kind::kUint8},   {"char", Kind::kUint8},  {"int8", Kind::kInt8},
      {"uint8", Kind::kUint8},  {"short", Kind::kInt16},   {"int16", Kind::kInt16}, {"uint16", Kind::kUint16},
      {"int32", Kind::kInt32},  {"uint32", Kind::kUint32}, {"int64", Kind::kInt64}, {"uint64", Kind::kUint64},
      {"float", Kind::kFloat},  {"double", Kind::kDouble}};
  return types;
}

// Bytes that a value takes at least, less what is left out between them.
std::size_t smallest_size(const IdlType& type) {
  switch (type.kind) {
    case Kind::kStruct: {
      std::size_t size = 0;
      for (const auto& field : type.fields) size += smallest_size(*field.type);
      return size;
    }
    case Kind::kArray:
      return type.size * smallest_size(*type.item);  // no more than kLargestArray, as it was let in
    default:
      return 1;
  }
}

// ROS 2 names a struct of its own in two ways: "pkg::msg::dds_::Type_" on the wire, "pkg/msg/Type" for
// people.
std::string ros_name_of_scope(const std::string& scoped) {
  std::string name;
  bool is_mangled = false;
  for (std::size_t begin = 0; begin <= scoped.size();) {
    const std::size_t end = std::min(scoped.find("::", begin), scoped.size());
    const std::string part = scoped.substr(begin, end - begin);
    if (part == "dds_") {
      is_mangled = true;
    } else {
      name += (name.empty() ? "" : "/") + part;
    }
    begin = end + 2;
  }
  if (is_mangled && name.ends_with('_')) name.pop_back();
  return name;
}

class Parser {
 public:
  Parser(std::string_view text, std::map<std::string, Type>& types)
      : tokens_(tokens_of(text)), types_(types) {}

  Status parse() {
    while (!peek().empty()) {
      if (Status parsed = definition(0); !parsed) return parsed;
    }
    return {};
  }

 private:
  [[nodiscard]] const std::string& peek() const { return tokens_[at_].text; }
  std::string next() {
    std::string text = tokens_[at_].text;
    if (at_ + 1 < tokens_.size()) ++at_;
    return text;
  }
  [[nodiscard]] Error wrong(const std::string& expected) const {
    return {ErrorCode::kInvalidArgument,
            fmt::format("line {}: {} is expected, found {}", tokens_[at_].line, expected,
                        peek().empty() ? "the end" : "'" + peek().substr(0, 40) + "'")};
  }
  Status expect(const std::string& text) {
    if (peek() != text) return wrong("'" + text + "'");
    next();
    return {};
  }
  Result<std::string> name(const std::string& what) {
    const std::string& text = peek();
    if (text.empty() || (std::isalpha(static_cast<unsigned char>(text[0])) == 0 && text[0] != '_') ||
        text.find('.') != std::string::npos) {
      return wrong(what);
    }
    std::string word = next();
    // an underscore in front only escapes a word of IDL
    if (word.size() > 1 && word.front() == '_') word.erase(0, 1);
    return word;
  }
  // @key, @default (value=0), @verbatim (...)
  void pass_annotations() {
    while (peek() == "@") {
      next();
      next();
      while (peek() == "::") {
        next();
        next();
      }
      if (peek() != "(") continue;
      int open = 0;
      do {
        const std::string text = next();
        open += text == "(" ? 1 : text == ")" ? -1 : 0;
      } while (open > 0 && !peek().empty());
    }
  }

  Status definition(int depth) {
    if (depth > kDeepest) return wrong("less nesting");
    pass_annotations();
    if (peek() == "module") return module(depth);
    if (peek() == "struct") return structure();
    if (peek() == "enum") return enumeration();
    if (peek() == "typedef") return type_name();
    if (peek() == "const") return constant();
    return wrong("module, struct, enum, typedef or const");
  }

  Status module(int depth) {
    next();
    const auto word = name("the name of a module");
    if (!word) return word.error();
    if (Status open = expect("{"); !open) return open;
    const std::string outer = scope_;
    scope_ += (scope_.empty() ? "" : "::") + *word;
    while (peek() != "}") {
      if (peek().empty()) return wrong("'}'");
      if (Status inner = definition(depth + 1); !inner) return inner;
    }
    scope_ = outer;
    next();
    return expect(";");
  }

  Status structure() {
    next();
    const auto word = name("the name of a struct");
    if (!word) return word.error();
    const std::string scoped = scoped_name(*word);
    auto type = std::make_shared<IdlType>();
    type->kind = Kind::kStruct;
    type->name = ros_name_of_scope(scoped);
    if (Status open = expect("{"); !open) return open;
    while (peek() != "}") {
      pass_annotations();
      const auto field_type = type_reference(0);
      if (!field_type) return field_type.error();
      do {
        const auto field = name("the name of a field");
        if (!field) return field.error();
        const auto whole = with_dimensions(*field_type);
        if (!whole) return whole.error();
        type->fields.push_back({*field, *whole});
      } while (peek() == "," && !next().empty());
      if (Status end = expect(";"); !end) return end;
    }
    if (type->fields.empty()) return wrong("a field");
    if (smallest_size(*type) > kLargestArray) return wrong("a smaller struct");
    next();
    types_[ros_name_of_scope(scoped)] = std::move(type);
    return expect(";");
  }

  Status enumeration() {
    next();
    const auto word = name("the name of an enum");
    if (!word) return word.error();
    auto type = std::make_shared<IdlType>();
    type->kind = Kind::kEnum;
    type->name = ros_name_of_scope(scoped_name(*word));
    if (Status open = expect("{"); !open) return open;
    while (peek() != "}") {
      pass_annotations();
      const auto value = name("a word of the enum");
      if (!value) return value.error();
      type->words.push_back(*value);
      if (peek() == ",") next();
    }
    next();
    types_[ros_name_of_scope(scoped_name(*word))] = std::move(type);
    return expect(";");
  }

  Status type_name() {
    next();
    const auto target = type_reference(0);
    if (!target) return target.error();
    do {
      const auto word = name("the name of a type");
      if (!word) return word.error();
      const auto whole = with_dimensions(*target);
      if (!whole) return whole.error();
      types_[ros_name_of_scope(scoped_name(*word))] = *whole;
    } while (peek() == "," && !next().empty());
    return expect(";");
  }

  // kept if it is a size; other values are of no use here
  Status constant() {
    next();
    if (const auto type = type_reference(0); !type) return type.error();
    const auto word = name("the name of a constant");
    if (!word) return word.error();
    if (Status is = expect("="); !is) return is;
    if (const auto value = number(peek())) constants_[*word] = *value;
    while (peek() != ";" && !peek().empty()) next();
    return expect(";");
  }

  // "[3][4]" behind a name: an array of three arrays of four
  Result<Type> with_dimensions(Type type) {
    std::vector<std::size_t> sizes;
    std::size_t bytes = smallest_size(*type);
    while (peek() == "[") {
      next();
      const auto size = count("the size of an array");
      if (!size) return size.error();
      if (*size == 0 || *size > kLargestArray / bytes) return wrong("a smaller array");
      bytes *= *size;
      sizes.push_back(*size);
      if (Status end = expect("]"); !end) return end.error();
    }
    for (auto size = sizes.rbegin(); size != sizes.rend(); ++size) {
      auto array = std::make_shared<IdlType>();
      array->kind = Kind::kArray;
      array->item = std::move(type);
      array->size = *size;
      type = std::move(array);
    }
    return type;
  }

  static std::optional<std::size_t> number(const std::string& text) {
    std::size_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
  }

  Result<std::size_t> count(const std::string& what) {
    auto value = number(peek());
    if (const auto named = constants_.find(peek()); named != constants_.end()) value = named->second;
    if (!value) return wrong(what);
    next();
    return *value;
  }

  static Type basic(Kind kind) {
    auto type = std::make_shared<IdlType>();
    type->kind = kind;
    return type;
  }

  Result<Type> type_reference(int depth) {
    if (depth > kDeepest) return wrong("less nesting");
    if (peek() == "sequence") return sequence(depth);
    if (peek() == "string") {
      next();
      auto type = std::make_shared<IdlType>();
      type->kind = Kind::kString;
      if (peek() == "<") {
        next();
        const auto bound = count("the longest length of the string");
        if (!bound) return bound.error();
        type->size = *bound;
        if (Status end = expect(">"); !end) return end.error();
      }
      return Type(type);
    }
    if (peek() == "unsigned" || peek() == "long" || peek() == "short") {
      const bool is_unsigned = peek() == "unsigned";
      if (is_unsigned) next();
      if (peek() == "short") {
        next();
        return basic(is_unsigned ? Kind::kUint16 : Kind::kInt16);
      }
      if (peek() != "long") return wrong("short or long");
      next();
      if (peek() == "double") return wrong("a type that has a JSON form");
      if (peek() == "long") {
        next();
        return basic(is_unsigned ? Kind::kUint64 : Kind::kInt64);
      }
      return basic(is_unsigned ? Kind::kUint32 : Kind::kInt32);
    }
    if (const auto found = basic_types().find(peek()); found != basic_types().end()) {
      next();
      return basic(found->second);
    }
    return named_type();
  }

  Result<Type> sequence(int depth) {
    next();
    if (Status open = expect("<"); !open) return open.error();
    auto type = std::make_shared<IdlType>();
    type->kind = Kind::kSequence;
    auto item = type_reference(depth + 1);
    if (!item) return item.error();
    type->item = std::move(*item);
    if (peek() == ",") {
      next();
      const auto bound = count("the greatest length of the sequence");
      if (!bound) return bound.error();
      type->size = *bound;
    }
    if (Status end = expect(">"); !end) return end.error();
    return Type(type);
  }

  // looked for in this module, then in those around it
  Result<Type> named_type() {
    const std::size_t begin = at_;
    std::string scoped;
    if (peek() == "::") next();
    for (;;) {
      const auto word = name("a type");
      if (!word) return word.error();
      scoped += *word;
      if (peek() != "::") break;
      next();
      scoped += "::";
    }
    for (std::string scope = scope_;;) {
      const auto found = types_.find(ros_name_of_scope(scope.empty() ? scoped : scope + "::" + scoped));
      if (found != types_.end()) return found->second;
      if (scope.empty()) break;
      const std::size_t cut = scope.rfind("::");
      scope.resize(cut == std::string::npos ? 0 : cut);
    }
    at_ = begin;
    return wrong("a type that is defined before (give the file that defines it, too)");
  }

  [[nodiscard]] std::string scoped_name(const std::string& word) const {
    return scope_.empty() ? word : scope_ + "::" + word;
  }

  std::vector<Token> tokens_;
  std::map<std::string, Type>& types_;
  std::map<std::string, std::size_t> constants_;
  std::string scope_;
  std::size_t at_ = 0;
};

}  // namespace

Status IdlTypes::add(std::string_view text) {
  auto types = types_;
  if (Status parsed = Parser(text, types).parse(); !parsed) return parsed;
  types_ = std::move(types);
  return {};
}

std::shared_ptr<const IdlType> IdlTypes::definition(const std::string& ros_name) const {
  const auto found = types_.find(ros_name);
  if (found != types_.end() && found->second->kind == Kind::kStruct) return found->second;
  return nullptr;
}

}  // namespace nido
