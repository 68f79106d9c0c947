#pragma once

#include <algorithm>
#include <string>

namespace nido {

// What the tests with processes that are killed send: one letter again and again. Anything else was torn.
inline bool is_even(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [&](char c) { return c == text.front(); });
}

}  // namespace nido
