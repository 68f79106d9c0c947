#pragma once

#include <string>
#include <vector>

namespace nido {

// The candidate that `word` is most likely a misspelling of; empty if none is near.
std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates);

// "a, b, c"; "nothing" for an empty list.
std::string join_words(const std::vector<std::string>& words, const std::string& separator = ", ");

}  // namespace nido
