#pragma once

#include <span>
#include <string_view>

namespace nido {

// The word that `given` is most likely a misspelling of; empty if none is near.
std::string_view nearest_of(std::string_view given, std::span<const std::string_view> words);

}  // namespace nido
