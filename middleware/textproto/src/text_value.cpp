#include "nido/textproto/text_value.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>

namespace nido {
namespace {

constexpr std::size_t kLongestLine = 64 * 1024;
constexpr int kDeepestList = 8;

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

Error bad(std::string message) { return Error{ErrorCode::kInvalidArgument, std::move(message)}; }

class Parser {
 public:
  explicit Parser(std::string_view line) : line_(line) {}

  Result<std::vector<TextValue>> parse_line() {
    Result<std::vector<TextValue>> values = parse_values(0);
    if (values && next_ < line_.size()) return bad("there is a ')' without a '('");
    return values;
  }

 private:
  // up to the end of the line or the ')' that closes this list
  Result<std::vector<TextValue>> parse_values(int depth) {
    std::vector<TextValue> values;
    for (;;) {
      while (next_ < line_.size() && is_space(line_[next_])) ++next_;
      if (next_ == line_.size() || line_[next_] == ')') return values;
      Result<TextValue> value = parse_value(depth);
      if (!value) return value.error();
      values.push_back(std::move(*value));
    }
  }

  Result<TextValue> parse_value(int depth) {
    switch (line_[next_]) {
      case '(': {
        if (depth >= kDeepestList) return bad(fmt::format("lists are nested deeper than {}", kDeepestList));
        ++next_;
        Result<std::vector<TextValue>> inner = parse_values(depth + 1);
        if (!inner) return inner.error();
        if (next_ == line_.size()) return bad("a '(' is not closed");
        ++next_;
        return TextValue{std::move(*inner)};
      }
      case '"':
        return parse_string();
      case '[': {
        const std::size_t end = line_.find(']', next_);
        if (end == std::string_view::npos) return bad("a '[' is not closed");
        std::string text(line_.substr(next_ + 1, end - next_ - 1));
        next_ = end + 1;
        return TextValue{TextValue::Word{std::move(text), true}};
      }
      default:
        return parse_bare();
    }
  }

  Result<TextValue> parse_string() {
    std::string text;
    for (++next_; next_ < line_.size(); ++next_) {
      if (line_[next_] == '"') {
        ++next_;
        return TextValue{std::move(text)};
      }
      if (line_[next_] == '\\' && next_ + 1 < line_.size()) ++next_;
      text += line_[next_];
    }
    return bad("a '\"' is not closed");
  }

  Result<TextValue> parse_bare() {
    const std::size_t start = next_;
    while (next_ < line_.size() && !is_space(line_[next_]) && line_[next_] != '(' && line_[next_] != ')')
      ++next_;
    const std::string_view text = line_.substr(start, next_ - start);
    const char first = text.front() == '-' || text.front() == '+'
                           ? text[std::min<std::size_t>(1, text.size() - 1)]
                           : text.front();
    if ((first < '0' || first > '9') && first != '.')
      return TextValue{TextValue::Word{std::string(text), false}};
    const std::string_view digits = text.front() == '+' ? text.substr(1) : text;
    long long whole = 0;
    const char* const end = digits.data() + digits.size();
    if (const auto [stop, code] = std::from_chars(digits.data(), end, whole);
        stop == end && code == std::errc{}) {
      return TextValue{whole};
    }
    double number = 0;
    const auto [stop, code] = std::from_chars(digits.data(), end, number);
    if (stop != end) return TextValue{TextValue::Word{std::string(text), false}};
    if (code != std::errc{}) return bad(fmt::format("the number {} is out of range", text));
    return TextValue{number};
  }

  std::string_view line_;
  std::size_t next_ = 0;
};

void append(std::string& out, const TextValue& value);

void append(std::string& out, const std::vector<TextValue>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0) out += ' ';
    append(out, values[i]);
  }
}

void append(std::string& out, const TextValue& value) {
  if (const auto* word = std::get_if<TextValue::Word>(&value.content)) {
    out += word->bracketed ? '[' + word->text + ']' : word->text;
  } else if (const auto* text = std::get_if<std::string>(&value.content)) {
    out += '"';
    for (const char c : *text) {
      if (c == '"' || c == '\\') out += '\\';
      out += c;
    }
    out += '"';
  } else if (const auto* whole = std::get_if<long long>(&value.content)) {
    out += std::to_string(*whole);
  } else if (const auto* number = std::get_if<double>(&value.content)) {
    out += format_number(*number);
  } else {
    out += '(';
    append(out, *value.list());
    out += ')';
  }
}

}  // namespace

bool TextValue::is_word(std::string_view wanted) const {
  const std::string* found = text();
  return found != nullptr && *found == wanted;
}

const std::string* TextValue::text() const {
  if (const auto* word = std::get_if<Word>(&content)) return &word->text;
  return std::get_if<std::string>(&content);
}

bool TextValue::is_number() const {
  return std::holds_alternative<long long>(content) || std::holds_alternative<double>(content);
}

double TextValue::number() const {
  if (const auto* whole = std::get_if<long long>(&content)) return static_cast<double>(*whole);
  if (const auto* number = std::get_if<double>(&content)) return *number;
  return std::numeric_limits<double>::quiet_NaN();
}

Result<std::vector<TextValue>> parse_text(std::string_view line) {
  if (line.size() > kLongestLine)
    return bad(fmt::format("the line is longer than {} characters", kLongestLine));
  return Parser(line).parse_line();
}

std::string format_text(const std::vector<TextValue>& values) {
  std::string out;
  append(out, values);
  return out;
}

std::string format_number(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".einE") == std::string::npos) text += ".0";
  return text;
}

}  // namespace nido
