#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "nido/speech/phrases.h"

namespace nido {
namespace {

// "a": such a word is found at the end of "banana" and before "apple", whether it is said or not.
bool is_one_sound(const std::vector<std::string>& pronunciations) {
  return std::all_of(pronunciations.begin(), pronunciations.end(),
                     [](const std::string& sounds) { return split_words(sounds).size() == 1; });
}

}  // namespace

std::string phrase_grammar(const PhraseBook& book, double own_word_cost) {
  constexpr double kBranch = 0.5;  // of a word inside a phrase
  constexpr int kFinal = 1;
  std::string transitions;
  const auto connect = [&transitions](int from, int to, double probability, const std::string& word) {
    transitions += fmt::format("TRANSITION {} {} {:.6g} {}\n", from, to, probability, word);
  };
  // the phrases as a tree
  const auto texts = book.texts();
  int states = 2;
  std::map<std::pair<int, std::string>, int> branches;
  for (const auto& text : texts) {
    const auto words = split_words(text);
    int state = 0;
    for (std::size_t i = 0; i < words.size(); ++i) {
      const double probability = state == 0 ? 1.0 / static_cast<double>(texts.size()) : kBranch;
      if (i + 1 == words.size()) {
        connect(state, kFinal, probability, words[i]);
        break;
      }
      const auto [branch, is_new] = branches.try_emplace({state, words[i]}, states);
      if (is_new) connect(state, states++, probability, words[i]);
      state = branch->second;
    }
  }
  // their words in any order
  const int loop = states++;
  for (const int from : {0, loop}) {
    for (const auto& [word, sounds] : book.pronunciations) {
      if (!is_one_sound(sounds)) connect(from, loop, std::exp(-own_word_cost), word);
    }
  }
  connect(loop, kFinal, 1.0, "");
  return fmt::format("FSG_BEGIN phrases\nNUM_STATES {}\nSTART_STATE 0\nFINAL_STATE {}\n{}FSG_END\n", states,
                     kFinal, transitions);
}

}  // namespace nido
