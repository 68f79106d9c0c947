#include "nido/speech/phrases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <sstream>

namespace nido {
namespace {

PhraseBook shipped() {
  auto book = PhraseBook::load(NIDO_PHRASES);
  EXPECT_TRUE(book.ok()) << (book.ok() ? "" : book.error().message);
  return book.ok() ? *book : PhraseBook{};
}

std::string load_error(const std::string& content) {
  const auto path = std::filesystem::path(testing::TempDir()) / "phrases_test.yaml";
  std::ofstream(path) << content;
  const auto book = PhraseBook::load(path.string());
  return book.ok() ? "" : book.error().message;
}

constexpr const char* kHead = "objects:\n  - {name: red ball, colour: red, shape: ball}\n";
constexpr const char* kWords = "pronunciations:\n  red: [R EH D]\n  ball: [B AO L]\n";

TEST(PhraseBook, NamesForThingsThatAreTaughtAreSentencesOfTheirOwn) {
  PhraseBook book = shipped();
  const auto before = book.texts().size();
  EXPECT_FALSE(book.add_name("banana"));  // nobody knows how it sounds
  EXPECT_EQ(book.texts().size(), before);
  for (const char* word : {"this", "is", "a", "banana", "split"}) book.pronunciations[word] = {"AH"};
  ASSERT_TRUE(book.add_name(" banana"));
  EXPECT_EQ(book.texts().back(), "this is a banana");
  EXPECT_TRUE(book.names_a_thing("this is a banana"));
  EXPECT_FALSE(book.names_a_thing("this is a lemon"));
  EXPECT_FALSE(book.find("this is a banana"));  // not an order
  EXPECT_FALSE(book.add_name("banana"));
  EXPECT_FALSE(book.add_name(""));
  const auto texts = book.texts();
  EXPECT_EQ(texts.size(), before + 5);  // with the orders about it
  for (const char* text : {"banana", "reach banana", "grasp banana", "drop banana into basket"})
    EXPECT_NE(std::find(texts.begin(), texts.end(), text), texts.end()) << text;
}

TEST(PhraseBook, OrdersAboutThingsOfAnyNameAreUnderstood) {
  PhraseBook book = shipped();
  const auto drop = book.order_in("drop banana split into basket");
  ASSERT_TRUE(drop);
  EXPECT_EQ(drop->verb, Verb::kDrop);
  EXPECT_EQ(drop->name, "banana split");
  ASSERT_TRUE(book.order_in("grasp banana"));
  EXPECT_EQ(book.order_in("grasp banana")->name, "banana");
  for (const char* text : {"banana", "grasp", "drop into basket", "drop banana", "eat banana"})
    EXPECT_FALSE(book.order_in(text)) << text;
  book.names.emplace_back("banana");
  ASSERT_TRUE(book.order_in("banana"));
  EXPECT_EQ(book.order_in("banana")->verb, Verb::kLook);

  const std::size_t objects = book.objects.size();
  const std::size_t phrases = book.phrases.size();
  EXPECT_EQ(book.take_order(*drop), phrases);
  EXPECT_EQ(book.take_order(*drop), phrases);  // known by now
  EXPECT_EQ(book.take_order({"grasp banana split", Verb::kGrasp, "banana split"}), phrases + 1);
  EXPECT_EQ(book.objects.size(), objects + 1);
  EXPECT_EQ(book.object_of(book.phrases[phrases]).name, "banana split");
  EXPECT_EQ(book.find("drop banana split into basket"), phrases);
}

TEST(PhraseBook, CorrectionsOfAReachAreUnderstoodWhereTheyAreWanted) {
  PhraseBook book = shipped();
  const auto before = book.texts().size();
  EXPECT_FALSE(book.corrects("a bit left"));
  book.corrections = true;
  EXPECT_TRUE(book.corrects("a bit left"));
  EXPECT_TRUE(book.corrects("a bit closer"));
  EXPECT_FALSE(book.corrects("a bit sideways"));
  EXPECT_FALSE(book.find("a bit left"));  // not an order
  EXPECT_EQ(book.texts().size(), before + kDirections.size());
}

TEST(Phrases, ShippedFileHoldsTheTwentyEightOfTheExperiment) {
  const PhraseBook book = shipped();
  EXPECT_EQ(book.phrases.size(), 28U);
  EXPECT_EQ(book.objects.size(), 7U);
  std::set<std::pair<Verb, std::size_t>> pairs;
  for (const auto& phrase : book.phrases) {
    pairs.insert({phrase.verb, phrase.object_index});
    EXPECT_NE(phrase.text.find(book.object_of(phrase).name), std::string::npos) << phrase.text;
  }
  EXPECT_EQ(pairs.size(), 28U);
  ASSERT_TRUE(book.find("drop blue cube into basket"));
  EXPECT_EQ(book.phrases[*book.find("drop blue cube into basket")].verb, Verb::kDrop);
  EXPECT_FALSE(book.find("drop blue cube"));
}

TEST(Phrases, MissingFileIsNotFound) {
  const auto book = PhraseBook::load("/nowhere/phrases.yaml");
  ASSERT_FALSE(book.ok());
  EXPECT_EQ(book.error().code, ErrorCode::kNotFound);
  EXPECT_NE(book.error().message.find("/nowhere/phrases.yaml"), std::string::npos);
}

TEST(Phrases, FaultsAreNamedWithTheirLine) {
  const std::string good =
      std::string(kHead) + "phrases:\n  - {text: red ball, verb: look, object: red ball}\n" + kWords;
  EXPECT_EQ(load_error(good), "");
  EXPECT_NE(load_error(std::string(kHead) + "phrases:\n  - {text: red ball, verb: eat, object: red ball}\n" +
                       kWords)
                .find(":4: unknown verb 'eat'; allowed are look, reach, grasp, drop"),
            std::string::npos);
  EXPECT_NE(load_error(std::string(kHead) + "phrases:\n  - {text: red ball, verb: look, object: red cat}\n" +
                       kWords)
                .find(":4: the object 'red cat'"),
            std::string::npos);
  EXPECT_NE(load_error(std::string(kHead) + "phrases:\n  - {text: red cat, verb: look, object: red ball}\n" +
                       kWords)
                .find("the word 'cat' has no entry"),
            std::string::npos);
  EXPECT_NE(load_error(good + "colours: [red]\n").find("unknown section 'colours'"), std::string::npos);
  EXPECT_NE(load_error(std::string(kHead) + "phrases:\n  - {text: red ball, verb: look}\n" + kWords)
                .find("the key 'object' is missing"),
            std::string::npos);
  EXPECT_NE(load_error(std::string(kHead) +
                       "phrases:\n  - {text: red ball, verb: look, object: red ball}\n"
                       "  - {text: red  ball, verb: look, object: red ball}\n" +
                       kWords)
                .find("comes twice"),
            std::string::npos);
  EXPECT_NE(load_error("objects: [").find("phrases_test.yaml:"), std::string::npos);
}

TEST(Phrases, OrdersAreSeparatedBySemicolons) {
  const auto orders = split_orders(" drop red  ball into basket ;@8.5 stop;; reach blue cube");
  ASSERT_EQ(orders.size(), 3U);
  EXPECT_EQ(orders[0].text, "drop red ball into basket");
  EXPECT_FALSE(orders[0].at_s);
  EXPECT_EQ(orders[1].text, "stop");
  EXPECT_DOUBLE_EQ(orders[1].at_s.value_or(-1.0), 8.5);
  EXPECT_EQ(orders[2].text, "reach blue cube");
  EXPECT_TRUE(split_orders(" ; ").empty());
  EXPECT_EQ(split_orders("@x stop")[0].text, "@x stop");
}

TEST(Phrases, StopInterrupts) {
  const PhraseBook book = shipped();
  EXPECT_TRUE(book.interrupts("stop"));
  EXPECT_FALSE(book.interrupts("red ball"));
  EXPECT_GT(book.other_words.size(), 100U);
}

TEST(Phrases, NewOnesAreAddedOrRefused) {
  PhraseBook book = shipped();
  book.pronunciations["yellow"] = {"Y EH L OW"};
  const NamedObject yellow_cube{"yellow cube", "yellow", "cube"};
  ASSERT_TRUE(book.add("grasp  yellow cube", Verb::kGrasp, yellow_cube).ok());
  ASSERT_TRUE(book.find("grasp yellow cube"));
  EXPECT_EQ(book.objects.size(), 8U);
  EXPECT_TRUE(book.add("yellow cube", Verb::kLook, yellow_cube).ok());
  EXPECT_EQ(book.objects.size(), 8U);
  EXPECT_FALSE(book.add("yellow cube", Verb::kLook, yellow_cube).ok());
  EXPECT_FALSE(book.add("stop", Verb::kLook, yellow_cube).ok());
  EXPECT_FALSE(book.add("pink cube", Verb::kLook, {"pink cube", "pink", "cube"}).ok());
  EXPECT_FALSE(book.add("reach yellow cube", Verb::kReach, {"yellow cube", "red", "cube"}).ok());
  EXPECT_EQ(book.phrases.size(), 30U);
}

// "banana a" and "a apple" would fit better than the names alone.
TEST(Grammar, WordsOfOneSoundAreNoWordsOfTheirOwn) {
  PhraseBook book = shipped();
  for (const auto& [word, sounds] : std::map<std::string, std::vector<std::string>>{
           {"this", {"DH IH S"}}, {"is", {"IH Z"}}, {"a", {"AH", "EY"}}, {"banana", {"B AH N AE N AH"}}}) {
    book.pronunciations[word] = sounds;
  }
  ASSERT_TRUE(book.add_name("banana"));
  std::istringstream stream(phrase_grammar(book));
  std::map<std::string, int> loops;  // by word: from a state to itself
  int articles = 0;
  for (std::string line; std::getline(stream, line);) {
    const auto words = split_words(line);
    if (words[0] != "TRANSITION" || words.size() < 5) continue;
    if (words[1] == words[2]) ++loops[words[4]];
    articles += words[4] == "a" ? 1 : 0;
  }
  EXPECT_EQ(loops["banana"], 1);
  EXPECT_EQ(loops["ball"], 1);
  EXPECT_EQ(loops["a"], 0);
  EXPECT_EQ(articles, 1);  // in "this is a banana"
}

// Walks the grammar: every phrase ends in the final state at less cost than its words in the loop.
TEST(Grammar, HasEveryPhraseAndTheirWordsInAnyOrder) {
  const PhraseBook book = shipped();
  std::istringstream stream(phrase_grammar(book));
  std::map<std::pair<int, std::string>, std::vector<std::pair<int, double>>> steps;
  int states = 0;
  int final = -1;
  for (std::string line; std::getline(stream, line);) {
    const auto words = split_words(line);
    if (words[0] == "NUM_STATES") states = std::stoi(words[1]);
    if (words[0] == "FINAL_STATE") final = std::stoi(words[1]);
    if (words[0] == "TRANSITION") {
      steps[{std::stoi(words[1]), words.size() > 4 ? words[4] : ""}].emplace_back(std::stoi(words[2]),
                                                                                  std::stod(words[3]));
      EXPECT_LT(std::stoi(words[1]), states);
      EXPECT_LT(std::stoi(words[2]), states);
    }
  }
  const std::function<double(int, const std::vector<std::string>&, std::size_t)> best =
      [&](int state, const std::vector<std::string>& words, std::size_t index) {
        if (index == words.size() && state == final) return 1.0;
        double most = 0.0;
        if (index < words.size()) {
          for (const auto& [next, probability] : steps[{state, words[index]}])
            most = std::max(most, probability * best(next, words, index + 1));
        }
        for (const auto& [next, probability] : steps[{state, ""}])
          most = std::max(most, probability * best(next, words, index));
        return most;
      };
  for (const auto& text : book.texts()) EXPECT_GT(best(0, split_words(text), 0), 1e-3) << text;
  const double others = best(0, {"drop", "blue", "cube"}, 0);
  EXPECT_GT(others, 0.0);
  EXPECT_LT(others, 1e-5);
}

}  // namespace
}  // namespace nido
