#pragma once

// The shape of a reply: what kind each of its values is, whatever their content.

#include <string>
#include <vector>

#include "nido/yarp/bottle.h"

namespace nido::test {

// "[is] encs (f*6) [tsta] i f [ok]": words in brackets stay, as does a bare word that the line asked for;
// i whole number, f floating-point number, s other text; n equal values in a list are kind*n.
inline std::string shape_of(const std::vector<yarp::Value>& values, const std::string& asked = "") {
  const auto one = [&](const yarp::Value& value) -> std::string {
    if (value.kind == yarp::Value::Kind::kWord) return "[" + value.text + "]";
    if (value.is_integer()) return "i";
    if (value.is_number()) return "f";
    if (value.is_list()) return "(" + shape_of(value.items) + ")";
    return !asked.empty() && value.text == asked ? value.text : "s";
  };
  std::string shape;
  for (std::size_t i = 0; i < values.size();) {
    const std::string kind = one(values[i]);
    std::size_t same = 1;
    while (asked.empty() && i + same < values.size() && one(values[i + same]) == kind) ++same;
    shape += (shape.empty() ? "" : " ") + kind + (same > 1 ? "*" + std::to_string(same) : "");
    i += same;
  }
  return shape;
}

}  // namespace nido::test
