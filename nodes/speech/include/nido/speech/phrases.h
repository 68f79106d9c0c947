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

// All that the robot understands. Read from config/phrases.yaml; a plain value.
struct PhraseBook {
  std::vector<NamedObject> objects;
  std::vector<Phrase> phrases;
  std::map<std::string, std::vector<std::string>> pronunciations;  // word -> ARPAbet phones, at least one

  [[nodiscard]] const NamedObject& object_of(const Phrase& phrase) const {
    return objects[phrase.object_index];
  }
  // The phrase with exactly this text; nothing if there is none.
  [[nodiscard]] std::optional<std::size_t> find(const std::string& text) const;

  // Reads and checks a file: every phrase has a known verb and object and only words with a pronunciation, no
  // text comes twice. kNotFound if the file is not there, kInvalidArgument with file, line and what is
  // allowed otherwise.
  static Result<PhraseBook> load(const std::string& path);
};

// Words of a text, separated by blanks.
std::vector<std::string> split_words(const std::string& text);

// The phrases as a JSGF grammar with one public rule.
std::string jsgf_grammar(const PhraseBook& book);
// The phrases as a trigram language model in ARPA format (absolute discounting of 0.5, back-off).
std::string arpa_trigram(const PhraseBook& book);

}  // namespace nido
