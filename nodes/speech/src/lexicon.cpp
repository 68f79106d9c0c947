#include "lexicon.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <utility>

#include "nido/speech/phrases.h"

namespace nido {
namespace {

bool is_vowel(const std::string& sound) {
  return std::string("AEIOU").find(sound.front()) != std::string::npos;
}

// Without the R that only some say: "tiger", "guitar", "lizard"; not in "rabbit" or "carrot".
std::vector<std::string> without_r(const std::vector<std::string>& sounds) {
  std::vector<std::string> quiet;
  for (std::size_t i = 0; i < sounds.size(); ++i) {
    const bool before_vowel = i + 1 < sounds.size() && is_vowel(sounds[i + 1]);
    const bool after_vowel = i > 0 && is_vowel(sounds[i - 1]);
    if (sounds[i] == "R" && after_vowel && !before_vowel) continue;
    quiet.push_back(sounds[i] == "ER" && !before_vowel ? "AH" : sounds[i]);
  }
  return quiet;
}

}  // namespace

std::vector<std::string> with_other_accents(const std::vector<std::string>& pronunciations) {
  constexpr std::array<std::pair<const char*, const char*>, 3> kVowels = {
      {{"AE", "AA"}, {"AA", "AO"}, {"AH", "IH"}}};
  std::vector<std::string> all = pronunciations;
  const auto add = [&all](const std::vector<std::string>& sounds) {
    const std::string text = fmt::format("{}", fmt::join(sounds, " "));
    if (std::find(all.begin(), all.end(), text) == all.end()) all.push_back(text);
  };
  for (const std::string& pronunciation : pronunciations) {
    const auto sounds = split_words(pronunciation);
    if (sounds.size() < 2) continue;  // nothing would be left of it
    add(without_r(sounds));
    if (sounds.back() == "IY" && std::any_of(sounds.begin(), sounds.end() - 1, is_vowel)) {
      for (const char* last : {"IH", "EH"}) {
        auto other = sounds;
        other.back() = last;
        add(other);
      }
    }
    for (const auto& [from, to] : kVowels) {
      auto other = sounds;
      std::replace(other.begin(), other.end(), std::string(from), std::string(to));
      add(other);
      add(without_r(other));
    }
  }
  return all;
}

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
