#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// What a phrase asks for.
enum class Verb { kLook, kReach, kGrasp, kDrop };
inline constexpr std::size_t kVerbCount = 4;
inline constexpr std::array<Verb, kVerbCount> kAllVerbs = {Verb::kLook, Verb::kReach, Verb::kGrasp,
                                                           Verb::kDrop};
// "look", "reach", "grasp", "drop".
const char* verb_name(Verb verb);

// A kind of object that phrases name.
struct NamedObject {
  std::string name;    // "blue cube"
  std::string colour;  // "blue"
  std::string shape;   // "cube"
};

// One speech signal.
struct Phrase {
  std::string text;              // "drop blue cube into basket": lower-case words, one blank between
  Verb verb = Verb::kLook;       //
  std::size_t object_index = 0;  // into PhraseBook::objects
};

// "this is a banana": what a person says who shows the robot a thing.
inline constexpr const char* kNaming = "this is a ";
// "a bit left": what a person says whom a reach does not please, and the directions that the hand knows.
inline constexpr const char* kCorrection = "a bit ";
inline constexpr std::array<const char*, 7> kDirections = {"left", "right",   "up",    "down",
                                                           "back", "forward", "closer"};

// What is asked of a thing that is not among the objects of a book.
struct Order {
  std::string text;
  Verb verb = Verb::kLook;
  std::string name;
};

// All that the robot understands. Read from config/phrases.yaml; a plain value.
struct PhraseBook {
  std::vector<NamedObject> objects;
  std::vector<Phrase> phrases;
  std::vector<std::string> interruptions;  // texts that end whatever it does: "stop"
  std::vector<std::string> names;  // that things can be taught under, in sentences of kNaming: "banana"
  bool corrections = false;        // sentences of kCorrection are understood, with every one of kDirections
  // Words of other people's speech, which the acoustic model is adapted with, too (training/).
  std::vector<std::string> other_words;
  std::map<std::string, std::vector<std::string>> pronunciations;  // word -> ARPAbet phones, at least one

  [[nodiscard]] const NamedObject& object_of(const Phrase& phrase) const {
    return objects[phrase.object_index];
  }
  // The phrase with exactly this text; nothing if there is none.
  [[nodiscard]] std::optional<std::size_t> find(const std::string& text) const;
  [[nodiscard]] bool interrupts(const std::string& text) const;
  // A sentence that names a thing with one of `names`.
  [[nodiscard]] bool names_a_thing(const std::string& text) const;
  // A sentence that corrects a reach, where these are understood.
  [[nodiscard]] bool corrects(const std::string& text) const;
  // What is said about a thing of this name, as the phrases say it about the first object: "banana",
  // "reach banana", "grasp banana", "drop banana into basket".
  [[nodiscard]] std::vector<Order> orders_about(const std::string& name) const;
  // The other way round: what a text asks for, of a thing of any name. A name alone, which could be any text,
  // must be one of `names`. Nothing for other texts.
  [[nodiscard]] std::optional<Order> order_in(const std::string& text) const;
  // The phrase of an order; a new one, about an object without colour and shape, if there was none.
  std::size_t take_order(const Order& order);
  // Every text that can be said: phrases, interruptions, sentences that name things, orders about these,
  // sentences that correct.
  [[nodiscard]] std::vector<std::string> texts() const;
  // Adds a phrase about a new or a known object. Refused with kInvalidArgument, changing nothing, if the text
  // is there already, a word has no pronunciation, or the object is known with another colour or shape.
  Status add(const std::string& text, Verb verb, const NamedObject& object);

  // Adds a name for things that are taught, one or more words with pronunciations, as the words of kNaming
  // and of the orders must have. Refused with kInvalidArgument, changing nothing.
  Status add_name(const std::string& name);

  // Reads and checks a file, and other_words.yaml beside it if there is one (interruptions, other_words):
  // every phrase has a known verb and object and only words with a pronunciation, no text comes twice.
  // kNotFound if the file is not there, kInvalidArgument with file, line and what is allowed otherwise.
  static Result<PhraseBook> load(const std::string& path);
};

// What is said to the robot in one run.
struct SpokenOrder {
  std::string text;
  std::optional<double> at_s;  // after the beginning of the first; without it: a second after the one before
};
// "drop red ball into basket; @8 stop": parts separated by semicolons, each with a time if it begins with @.
// Parts without words are left out.
std::vector<SpokenOrder> split_orders(const std::string& text);

// Words of a text, separated by blanks.
std::vector<std::string> split_words(const std::string& text);

// "look", "reach", "grasp", "drop" to the verb; nothing for other words.
std::optional<Verb> verb_of(const std::string& name);

// The texts beside a loop over their words, as a finite state grammar of PocketSphinx: what is no phrase but
// said in the same words ("drop blue cube") comes out as these words. A word in the loop costs
// `own_word_cost` (natural logarithm), so that a phrase that is not spoken well is still one. Words of a
// single sound ("a") are not in the loop.
std::string phrase_grammar(const PhraseBook& book, double own_word_cost = 8.0);

}  // namespace nido
