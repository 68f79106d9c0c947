#include "lexicon.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <numeric>

#include "nido/speech/phrases.h"

namespace nido {

Result<std::map<std::string, std::vector<std::string>>> look_up_pronunciations(
    const std::string& dictionary, const std::set<std::string>& words) {
  std::ifstream stream(dictionary);
  if (!stream) {
    return Error{
        ErrorCode::kNotFound,
        fmt::format("the dictionary {} is missing: install the package pocketsphinx-en-us", dictionary)};
  }
  std::map<std::string, std::vector<std::string>> found;
  for (std::string line; std::getline(stream, line);) {
    const std::size_t end = line.find_first_of(" (");
    const std::size_t blank = line.find(' ');
    if (end == std::string::npos || blank == std::string::npos) continue;
    const std::string word = line.substr(0, end);
    if (words.contains(word)) {
      found[word].push_back(fmt::format("{}", fmt::join(split_words(line.substr(blank)), " ")));
    }
  }
  return found;
}

std::size_t phone_distance(const std::string& sound, const std::string& other) {
  const auto a = split_words(sound);
  const auto b = split_words(other);
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, changed});
    }
  }
  return row.back();
}

}  // namespace nido
