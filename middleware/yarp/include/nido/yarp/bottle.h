#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido::yarp {

// The two generations of YARP's binary notation. They differ in the codes of floating-point numbers (3.x: 64
// bit is 10, 32 bit is 128; 4.x: 20 and 10), and 4.x has words of eight letters.
enum class Dialect { k3, k4 };

// One value of a Bottle, YARP's list of anything.
struct Value {
  enum class Kind { kInt8, kInt16, kInt32, kInt64, kFloat32, kFloat64, kWord, kString, kBlob, kList, kDict };
  Kind kind = Kind::kList;
  std::int64_t integer = 0;    // of the four integer kinds
  double number = 0;           // of the two floating-point kinds
  std::string text;            // of words (1..8 letters, "[get]" without brackets), strings and blobs
  std::vector<Value> items{};  // of lists; of dictionaries: lists of a key (string) and a value

  static Value of(std::int64_t whole);
  static Value of(double number);
  static Value word(std::string_view letters);
  static Value string(std::string text);
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

using Bottle = std::vector<Value>;

// What a reader puts up with.
struct BottleLimits {
  std::size_t values = 200'000;  // in all lists together
  int depth = 32;                // of lists in lists
};

// The binary notation. A list whose values are all of one kind is written without a code for each, as YARP
// does.
[[nodiscard]] std::string encode(const Bottle& bottle, Dialect dialect);
// Reads one Bottle that fills `bytes` to the end. kInvalidArgument says what is wrong and at which byte;
// memory stays within a few times the size of `bytes`.
Result<Bottle> decode(std::string_view bytes, Dialect dialect, const BottleLimits& limits = {});

// A Bottle of either dialect, and which it was: what only one of them can read is of that one; what both read
// in the same way is of the `preferred` one.
struct Decoded {
  Bottle bottle;
  Dialect dialect = Dialect::k3;
};
Result<Decoded> decode_any(std::string_view bytes, Dialect preferred, const BottleLimits& limits = {});

// The notation of people: `[get] encs (1 2.5 "a b")`.
[[nodiscard]] std::string to_text(const Bottle& bottle);
[[nodiscard]] std::string to_text(const Value& value);
Result<Bottle> parse_bottle(std::string_view text, const BottleLimits& limits = {});
// Whether more lines belong to this text: a bracket or quote is open, or it ends in a backslash.
[[nodiscard]] bool continues(std::string_view text);

// yarp::sig::Vector: a Bottle of 64-bit numbers.
[[nodiscard]] Bottle vector_bottle(const std::vector<double>& values);

// A moment and a count, written "seq seconds": what travels beside a message.
struct Stamp {
  std::int64_t count = 0;
  double time_s = 0;
};
[[nodiscard]] std::string to_text(const Stamp& stamp);
Result<Stamp> parse_stamp(std::string_view text);

}  // namespace nido::yarp
