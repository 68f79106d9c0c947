#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "nido/value/value.h"

namespace nido {
namespace {

using Kind = Value::Kind;

bool is_separator(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',' || c == '\0'; }

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

// whether a string reads back as this string without quotes
bool stands_bare(std::string_view text) {
  if (text.empty() || text.size() > 200 || (!is_letter(text.front()) && text.front() != '_')) return false;
  for (const char c : text) {
    if (!is_letter(c) && !is_digit(c) && c != '_' && c != '.' && c != '-') return false;
  }
  return text != "true" && text != "false" && text != "null" && text != "inf" && text != "nan";
}

void append_quoted(std::string& out, std::string_view text) {
  out += '"';
  for (const char c : text) {
    switch (c) {
      case '"':
        out += "\\\"";
        break;
      case '\\':
        out += "\\\\";
        break;
      case '\n':
        out += "\\n";
        break;
      case '\r':
        out += "\\r";
        break;
      case '\0':
        out += "\\0";
        break;
      default:
        out += c;
    }
  }
  out += '"';
}

void append_number(std::string& out, double value) {
  if (std::isnan(value)) {
    out += "nan";
    return;
  }
  if (std::isinf(value)) {
    out += value > 0 ? "inf" : "-inf";
    return;
  }
  const std::size_t start = out.size();
  out += fmt::format("{}", value);
  if (out.find_first_of(".e", start) == std::string::npos) out += ".0";
}

void append_items(std::string& out, const std::vector<Value>& items);

void append(std::string& out, const Value& value) {
  switch (value.kind) {
    case Kind::kInt8:
    case Kind::kInt16:
    case Kind::kInt32:
    case Kind::kInt64:
      out += std::to_string(value.integer);
      return;
    case Kind::kFloat32: {
      // as many digits as a 32-bit number has
      const std::size_t start = out.size();
      const auto narrow = static_cast<float>(value.number);
      if (!std::isfinite(narrow)) return append_number(out, value.number);
      out += fmt::format("{}", narrow);
      if (out.find_first_of(".e", start) == std::string::npos) out += ".0";
      return;
    }
    case Kind::kFloat64:
      return append_number(out, value.number);
    case Kind::kWord:
      // YARP's truth values are words: one letter '1', and none
      if (value.text == "1") {
        out += "true";
      } else if (value.text.empty()) {
        out += "false";
      } else {
        out += '[' + value.text + ']';
      }
      return;
    case Kind::kString:
      if (stands_bare(value.text)) {
        out += value.text;
      } else {
        append_quoted(out, value.text);
      }
      return;
    case Kind::kBlob:
      out += '{';
      for (std::size_t i = 0; i < value.text.size(); ++i) {
        if (i > 0) out += ' ';
        out += std::to_string(static_cast<unsigned char>(value.text[i]));
      }
      out += '}';
      return;
    case Kind::kList:
    case Kind::kDict:
      out += '(';
      append_items(out, value.items);
      out += ')';
      return;
  }
}

void append_items(std::string& out, const std::vector<Value>& items) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (i > 0) out += ' ';
    append(out, items[i]);
  }
}

class Parser {
 public:
  Parser(std::string_view text, const ValueLimits& limits) : text_(text), limits_(limits) {}

  Result<Values> parse_all() {
    Result<Values> items = parse_items(0);
    if (items && at_ < text_.size()) return wrong("a ')' without a '('");
    return items;
  }

 private:
  Error wrong(const std::string& what) const {
    return {ErrorCode::kInvalidArgument, fmt::format("character {}: {}", at_ + 1, what)};
  }

  Result<Values> parse_items(int depth) {
    Values items;
    for (;;) {
      while (at_ < text_.size() && is_separator(text_[at_])) ++at_;
      if (at_ == text_.size() || text_[at_] == ')') return items;
      if (++values_ > limits_.values) return wrong(fmt::format("more than {} values", limits_.values));
      Result<Value> item = parse_value(depth);
      if (!item) return item.error();
      items.push_back(std::move(*item));
    }
  }

  Result<Value> parse_value(int depth) {
    switch (text_[at_]) {
      case '(': {
        if (depth >= limits_.depth)
          return wrong(fmt::format("lists are nested deeper than {}", limits_.depth));
        ++at_;
        Result<Values> items = parse_items(depth + 1);
        if (!items) return items.error();
        if (at_ == text_.size()) return wrong("a '(' is not closed");
        ++at_;
        return Value::list(std::move(*items));
      }
      case '"':
        return parse_quoted();
      case '[': {
        const std::size_t end = text_.find(']', at_);
        if (end == std::string_view::npos) return wrong("a '[' is not closed");
        const std::string_view letters = text_.substr(at_ + 1, end - at_ - 1);
        if (letters.empty() || letters.size() > 8) return wrong("a word in [] has one to eight letters");
        at_ = end + 1;
        return Value::word(letters);
      }
      case '{':
        return parse_blob();
      default:
        return parse_bare();
    }
  }

  Result<Value> parse_quoted() {
    std::string text;
    for (++at_; at_ < text_.size(); ++at_) {
      char c = text_[at_];
      if (c == '"') {
        ++at_;
        return Value::string(std::move(text));
      }
      if (c == '\\' && at_ + 1 < text_.size()) {
        c = text_[++at_];
        if (c == 'n')
          c = '\n';
        else if (c == 'r')
          c = '\r';
        else if (c == '0')
          c = '\0';
      }
      text += c;
    }
    return wrong("a '\"' is not closed");
  }

  Result<Value> parse_blob() {
    Value value;
    value.kind = Kind::kBlob;
    for (++at_;;) {
      while (at_ < text_.size() && is_separator(text_[at_])) ++at_;
      if (at_ == text_.size()) return wrong("a '{' is not closed");
      if (text_[at_] == '}') {
        ++at_;
        return value;
      }
      int byte = 0;
      const char* const end = text_.data() + text_.size();
      const auto [stop, code] = std::from_chars(text_.data() + at_, end, byte);
      if (code != std::errc{} || byte < -128 || byte > 255) return wrong("a byte is a number 0..255");
      at_ = static_cast<std::size_t>(stop - text_.data());
      value.text += static_cast<char>(byte);
    }
  }

  Result<Value> parse_bare() {
    const std::size_t start = at_;
    while (at_ < text_.size() && !is_separator(text_[at_]) && text_[at_] != '(' && text_[at_] != ')') ++at_;
    const std::string_view text = text_.substr(start, at_ - start);
    if (text == "true") return Value::word("1");
    if (text == "false") return Value::word("");
    if (text == "null") return Value::word("null");
    if (text == "inf" || text == "-inf" || text == "nan") return number_of(text);
    std::string_view digits = text;
    if (digits.front() == '+' || digits.front() == '-') digits.remove_prefix(1);
    if (!digits.empty() && (is_digit(digits.front()) || digits.front() == '.')) {
      const Result<Value> number = number_of(text);
      if (number) return number;
    }
    return Value::string(std::string(text));
  }

  // a failure when it is none
  Result<Value> number_of(std::string_view text) const {
    std::string_view digits = text.front() == '+' ? text.substr(1) : text;
    const char* const end = digits.data() + digits.size();
    std::int64_t whole = 0;
    if (digits.size() > 2 && digits[0] == '0' && (digits[1] == 'x' || digits[1] == 'X')) {
      const auto [stop, code] = std::from_chars(digits.data() + 2, end, whole, 16);
      if (stop == end && code == std::errc{}) return Value::of(whole);
    }
    if (const auto [stop, code] = std::from_chars(digits.data(), end, whole);
        stop == end && code == std::errc{}) {
      return Value::of(whole);
    }
    double number = 0;
    if (const auto [stop, code] = std::from_chars(digits.data(), end, number);
        stop == end && code == std::errc{}) {
      return Value::of(number);
    }
    return wrong("not a number");
  }

  std::string_view text_;
  ValueLimits limits_;
  std::size_t at_ = 0;
  std::size_t values_ = 0;
};

}  // namespace

std::string to_text(const Values& values) {
  std::string out;
  append_items(out, values);
  return out;
}

std::string to_text(const Value& value) {
  std::string out;
  append(out, value);
  return out;
}

Result<Values> parse_values(std::string_view text, const ValueLimits& limits) {
  return Parser(text, limits).parse_all();
}

bool continues(std::string_view text) {
  int open = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\\') {
      if (++i >= text.size() || text.substr(i) == "\r") return true;
      continue;
    }
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == '(') ++open;
    if (c == ')') --open;
  }
  return quoted || open > 0;
}

}  // namespace nido
