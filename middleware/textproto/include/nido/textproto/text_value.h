#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// One word, number or list of a line of text, in the notation of YARP's text mode: words `pos` or `[pos]`,
// strings
// `"a b"` with \" and \\, integers `3`, numbers `4.5`, lists `(1 2 3)`.
struct TextValue {
  struct Word {
    std::string text;
    bool bracketed = false;  // written as [text]
  };
  using List = std::vector<TextValue>;
  std::variant<Word, std::string, long long, double, List> content;

  [[nodiscard]] bool is_word(std::string_view text) const;
  // The word or string; nothing else has text.
  [[nodiscard]] const std::string* text() const;
  // Whole numbers and numbers; a word such as "nan" is none.
  [[nodiscard]] bool is_number() const;
  [[nodiscard]] double number() const;  // only if is_number()
  [[nodiscard]] const List* list() const { return std::get_if<List>(&content); }
};

// The line's values. Refuses, with kInvalidArgument, lines of more than 64 KiB, lists nested deeper than 8,
// brackets and quotes that do not close, and numbers that overflow.
Result<std::vector<TextValue>> parse_text(std::string_view line);

// The line that gives these values back.
std::string format_text(const std::vector<TextValue>& values);
// A number as YARP writes a floating-point one: always with a point or exponent, every digit that matters.
std::string format_number(double value);

}  // namespace nido
