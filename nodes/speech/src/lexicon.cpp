#include "lexicon.h"

#include <fmt/format.h>

#include <fstream>

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

}  // namespace nido
