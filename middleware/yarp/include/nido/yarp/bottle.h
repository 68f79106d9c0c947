#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "nido/value/value.h"

namespace nido::yarp {

// A Bottle is nido's list of anything, with which it shares both notations.
using nido::decode;
using nido::Dialect;
using nido::encode;
using nido::to_text;
using nido::Value;
using Bottle = nido::Values;
using BottleLimits = nido::ValueLimits;

inline Result<Bottle> parse_bottle(std::string_view text, const BottleLimits& limits = {}) {
  return parse_values(text, limits);
}
// A Bottle of either dialect, and which it was: what only one of them can read is of that one; what both read
// in the same way is of the `preferred` one.
struct Decoded {
  Bottle bottle;
  Dialect dialect = Dialect::k3;
};
Result<Decoded> decode_any(std::string_view bytes, Dialect preferred, const BottleLimits& limits = {});
// yarp::sig::Vector.
[[nodiscard]] inline Bottle vector_bottle(const std::vector<double>& values) {
  return list_of_numbers(values);
}

// A moment and a count, written "seq seconds": what travels beside a message.
struct Stamp {
  std::int64_t count = 0;
  double time_s = 0;
};
[[nodiscard]] std::string to_text(const Stamp& stamp);
Result<Stamp> parse_stamp(std::string_view text);

}  // namespace nido::yarp
