#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>

#include "nido/speech/phrases.h"

namespace nido {

namespace {

using Gram = std::vector<std::string>;

// how often each sequence of `order` words comes in the phrases, with sentence marks
std::map<Gram, double> count_grams(const PhraseBook& book, std::size_t order) {
  std::map<Gram, double> counts;
  for (const auto& text : book.texts()) {
    Gram words = split_words(text);
    words.insert(words.begin(), "<s>");
    words.push_back("</s>");
    for (std::size_t i = 0; i + order <= words.size(); ++i) {
      counts[Gram(words.begin() + static_cast<std::ptrdiff_t>(i),
                  words.begin() + static_cast<std::ptrdiff_t>(i + order))] += 1.0;
    }
  }
  return counts;
}

constexpr double kDiscount = 0.5;
constexpr double kNever = -99.0;  // log10 of a probability that is never used, by the format's custom

}  // namespace

std::string jsgf_grammar(const PhraseBook& book) {
  std::string text = "#JSGF V1.0;\ngrammar phrases;\npublic <phrase> =\n";
  const auto texts = book.texts();
  for (std::size_t i = 0; i < texts.size(); ++i) {
    text += fmt::format("  {} {}\n", i == 0 ? " " : "|", texts[i]);
  }
  return text + "  ;\n";
}

std::string open_grammar(const PhraseBook& book, const std::vector<std::string>& rivals) {
  // costs of a word in the loop, as natural logarithms (docs/speech.md)
  constexpr double kOwnWord = -14.0;
  constexpr double kRival = -50.0;
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
    const Gram words = split_words(text);
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
  // everything else
  const int loop = states++;
  for (const int from : {0, loop}) {
    for (const auto& [word, sounds] : book.pronunciations) connect(from, loop, std::exp(kOwnWord), word);
    for (const auto& word : rivals) connect(from, loop, std::exp(kRival), word);
  }
  connect(loop, kFinal, 1.0, "");
  return fmt::format("FSG_BEGIN phrases\nNUM_STATES {}\nSTART_STATE 0\nFINAL_STATE {}\n{}FSG_END\n", states,
                     kFinal, transitions);
}

std::string arpa_trigram(const PhraseBook& book) {
  constexpr std::size_t kOrder = 3;
  std::array<std::map<Gram, double>, kOrder> counts;
  for (std::size_t n = 0; n < kOrder; ++n) {
    counts[n] = count_grams(book, n + 1);
  }

  // totals by history, and how many different words follow it
  std::array<std::map<Gram, double>, kOrder> history_total;
  std::array<std::map<Gram, double>, kOrder> followers;
  for (std::size_t n = 1; n < kOrder; ++n) {
    for (const auto& [gram, count] : counts[n]) {
      const Gram history(gram.begin(), gram.end() - 1);
      history_total[n][history] += count;
      followers[n][history] += 1.0;
    }
  }
  double unigram_total = 0.0;
  for (const auto& [gram, count] : counts[0]) {
    unigram_total += gram[0] == "<s>" ? 0.0 : count;
  }

  const auto probability = [&](const Gram& gram) {
    const std::size_t n = gram.size() - 1;
    const double count = counts[n].at(gram);
    if (n == 0) {
      return count / unigram_total;
    }
    return (count - kDiscount) / history_total[n].at(Gram(gram.begin(), gram.end() - 1));
  };
  // the mass that a history keeps for unseen words, over what the shorter history gives to them
  const auto back_off = [&](const Gram& history) {
    const std::size_t n = history.size();
    const double kept = kDiscount * followers[n].at(history) / history_total[n].at(history);
    double shorter_seen = 0.0;
    for (const auto& [gram, count] : counts[n]) {
      if (std::equal(history.begin(), history.end(), gram.begin())) {
        shorter_seen += probability(Gram(gram.begin() + 1, gram.end()));
      }
    }
    return kept / std::max(1e-6, 1.0 - shorter_seen);
  };

  std::string text = "\\data\\\n";
  for (std::size_t n = 0; n < kOrder; ++n) {
    text += fmt::format("ngram {}={}\n", n + 1, counts[n].size());
  }
  for (std::size_t n = 0; n < kOrder; ++n) {
    text += fmt::format("\n\\{}-grams:\n", n + 1);
    for (const auto& [gram, count] : counts[n]) {
      const bool start = n == 0 && gram[0] == "<s>";
      text += fmt::format("{:.4f} {}", start ? kNever : std::log10(probability(gram)), fmt::join(gram, " "));
      if (n + 1 < kOrder && gram.back() != "</s>") {
        text += fmt::format(" {:.4f}", std::log10(back_off(gram)));
      }
      text += "\n";
    }
  }
  return text + "\n\\end\\\n";
}

}  // namespace nido
