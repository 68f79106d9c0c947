#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// The two generations of the binary form, which is that of YARP's Bottles (docs/values.md); nido's own
// messages use k3. They differ in the codes of floating-point numbers (3.x: 64 bit is 10, 32 bit is 128; 4.x:
// 20 and 10), and 4.x has words of eight letters.
enum class Dialect { k3, k4 };

// One value: a number, word, string, blob, or a list of values.
struct Value {
  enum class Kind { kInt8, kInt16, kInt32, kInt64, kFloat32, kFloat64, kWord, kString, kBlob, kList, kDict };
  Kind kind = Kind::kList;
  std::int64_t integer = 0;    // of the four integer kinds
  double number = 0;           // of the two floating-point kinds
  std::string text;            // of words (1..8 letters, "[get]" without brackets), strings and blobs
  std::vector<Value> items{};  // of lists; of dictionaries: lists of a key (string) and a value

  static Value of(std::int64_t whole);  // 32 bit if that is enough
  static Value of(int whole) { return of(std::int64_t{whole}); }
  static Value of(double number);
  static Value word(std::string_view letters);
  static Value string(std::string text);
  static Value blob(std::string bytes);
  static Value list(std::vector<Value> items = {});

  [[nodiscard]] bool is_list() const { return kind == Kind::kList || kind == Kind::kDict; }
  [[nodiscard]] bool is_text() const { return kind == Kind::kWord || kind == Kind::kString; }
  [[nodiscard]] bool is_integer() const { return kind <= Kind::kInt64; }
  [[nodiscard]] bool is_number() const { return kind <= Kind::kFloat64; }
  // Integers too; only if is_number().
  [[nodiscard]] double as_number() const { return is_integer() ? static_cast<double>(integer) : number; }
  // A word or string with these letters.
  [[nodiscard]] bool is_word(std::string_view letters) const { return is_text() && text == letters; }
  bool operator==(const Value&) const = default;
};

// A list of anything: what a port of Values carries, and a line of text says.
using Values = std::vector<Value>;

// What a reader puts up with.
struct ValueLimits {
  std::size_t values = 200'000;  // in all lists together
  int depth = 32;                // of lists in lists
};

// The binary notation. A list whose values are all of one kind is written without a code for each, as YARP
// does.
[[nodiscard]] std::string encode(const Values& values, Dialect dialect);
// Reads one list that fills `bytes` to the end. kInvalidArgument says what is wrong and at which byte;
// memory stays within a few times the size of `bytes`.
Result<Values> decode(std::string_view bytes, Dialect dialect, const ValueLimits& limits = {});

// The notation of people: `[get] encs (1 2.5 "a b")`.
[[nodiscard]] std::string to_text(const Values& values);
[[nodiscard]] std::string to_text(const Value& value);
Result<Values> parse_values(std::string_view text, const ValueLimits& limits = {});
// Whether more lines belong to this text: a bracket or quote is open, or it ends in a backslash.
[[nodiscard]] bool continues(std::string_view text);

// 64-bit numbers, as yarp::sig::Vector has them.
[[nodiscard]] Values list_of_numbers(const std::vector<double>& values);

}  // namespace nido
