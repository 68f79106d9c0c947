#include "nido/yarp/bottle.h"

#include <fmt/format.h>

namespace nido::yarp {

Result<Decoded> decode_any(std::string_view bytes, Dialect preferred, const BottleLimits& limits) {
  Result<Bottle> first = decode(bytes, preferred, limits);
  if (first) return Decoded{std::move(*first), preferred};
  const Dialect other = preferred == Dialect::k3 ? Dialect::k4 : Dialect::k3;
  Result<Bottle> second = decode(bytes, other, limits);
  if (second) return Decoded{std::move(*second), other};
  return first.error();
}

std::string to_text(const Stamp& stamp) { return fmt::format("{} {:.6f}", stamp.count, stamp.time_s); }

Result<Stamp> parse_stamp(std::string_view text) {
  const Result<Bottle> bottle = parse_bottle(text, {16, 2});
  if (!bottle) return bottle.error();
  if (bottle->size() != 2 || !(*bottle)[0].is_integer() || !(*bottle)[1].is_number()) {
    return Error{ErrorCode::kInvalidArgument, "a stamp is a count and a time in seconds"};
  }
  return Stamp{(*bottle)[0].integer, (*bottle)[1].as_number()};
}

}  // namespace nido::yarp
