#include "nido/speech/phrases.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>

namespace nido {

namespace {

Error at(const std::string& path, const YAML::Node& node, const std::string& sentence) {
  return {ErrorCode::kInvalidArgument, fmt::format("{}:{}: {}", path, node.Mark().line + 1, sentence)};
}

// checks that a map has exactly these keys, all of them scalars
Status require_keys(const std::string& path, const YAML::Node& node, const std::vector<std::string>& keys) {
  const std::string allowed = fmt::format("{}", fmt::join(keys, ", "));
  if (!node.IsMap()) {
    return at(path, node, fmt::format("found no map; expected one with the keys {}", allowed));
  }
  for (const auto& entry : node) {
    const auto key = entry.first.as<std::string>();
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      return at(path, entry.first, fmt::format("unknown key '{}'; allowed are {}", key, allowed));
    }
    if (!entry.second.IsScalar()) {
      return at(path, entry.second, fmt::format("the value of '{}' must be a text", key));
    }
  }
  for (const auto& key : keys) {
    if (!node[key]) {
      return at(path, node, fmt::format("the key '{}' is missing; needed are {}", key, allowed));
    }
  }
  return {};
}

Result<YAML::Node> section(const std::string& path, const YAML::Node& root, const std::string& key,
                           bool sequence) {
  const YAML::Node node = root[key];
  if (!node) {
    return at(path, root, fmt::format("the section '{}' is missing", key));
  }
  if (sequence ? !node.IsSequence() : !node.IsMap()) {
    return at(path, node, fmt::format("the section '{}' must be a {}", key, sequence ? "list" : "map"));
  }
  return node;
}

}  // namespace

const char* verb_name(Verb verb) {
  switch (verb) {
    case Verb::kLook:
      return "look";
    case Verb::kReach:
      return "reach";
    case Verb::kGrasp:
      return "grasp";
    case Verb::kDrop:
      return "drop";
  }
  return "?";
}

std::vector<std::string> split_words(const std::string& text) {
  std::vector<std::string> words;
  std::istringstream stream(text);
  for (std::string word; stream >> word;) {
    words.push_back(word);
  }
  return words;
}

std::optional<std::size_t> PhraseBook::find(const std::string& text) const {
  for (std::size_t i = 0; i < phrases.size(); ++i) {
    if (phrases[i].text == text) {
      return i;
    }
  }
  return std::nullopt;
}

Result<PhraseBook> PhraseBook::load(const std::string& path) {
  if (!std::filesystem::exists(path)) {
    return Error{ErrorCode::kNotFound, fmt::format("{}: there is no such file of phrases", path)};
  }
  try {
    const YAML::Node root = YAML::LoadFile(path);
    if (!root.IsMap()) {
      return at(path, root, "expected a map with the sections objects, phrases, pronunciations");
    }
    for (const auto& entry : root) {
      const auto key = entry.first.as<std::string>();
      if (key != "objects" && key != "phrases" && key != "pronunciations") {
        return at(path, entry.first,
                  fmt::format("unknown section '{}'; allowed are objects, phrases, pronunciations", key));
      }
    }
    PhraseBook book;

    // what can be spoken of
    const auto objects = section(path, root, "objects", true);
    if (!objects) return objects.error();
    for (const auto& node : *objects) {
      if (const Status status = require_keys(path, node, {"name", "colour", "shape"}); !status) {
        return status.error();
      }
      book.objects.push_back({node["name"].as<std::string>(), node["colour"].as<std::string>(),
                              node["shape"].as<std::string>()});
    }

    // how it sounds
    const auto words = section(path, root, "pronunciations", false);
    if (!words) return words.error();
    for (const auto& entry : *words) {
      const auto word = entry.first.as<std::string>();
      if (!entry.second.IsSequence() || entry.second.size() == 0) {
        return at(path, entry.second, fmt::format("'{}' needs a list of at least one pronunciation", word));
      }
      book.pronunciations[word] = entry.second.as<std::vector<std::string>>();
    }

    // what can be said
    const auto phrases = section(path, root, "phrases", true);
    if (!phrases) return phrases.error();
    for (const auto& node : *phrases) {
      if (const Status status = require_keys(path, node, {"text", "verb", "object"}); !status) {
        return status.error();
      }
      Phrase phrase;
      phrase.text = fmt::format("{}", fmt::join(split_words(node["text"].as<std::string>()), " "));
      const auto verb = node["verb"].as<std::string>();
      const auto found_verb = std::find_if(kAllVerbs.begin(), kAllVerbs.end(),
                                           [&](Verb candidate) { return verb == verb_name(candidate); });
      if (found_verb == kAllVerbs.end()) {
        return at(path, node["verb"],
                  fmt::format("unknown verb '{}'; allowed are look, reach, grasp, drop", verb));
      }
      phrase.verb = *found_verb;
      const auto object = node["object"].as<std::string>();
      const auto found_object =
          std::find_if(book.objects.begin(), book.objects.end(),
                       [&](const NamedObject& candidate) { return candidate.name == object; });
      if (found_object == book.objects.end()) {
        return at(path, node["object"], fmt::format("the object '{}' is not in the section objects", object));
      }
      phrase.object_index = static_cast<std::size_t>(found_object - book.objects.begin());
      if (phrase.text.empty() || book.find(phrase.text)) {
        return at(path, node["text"], fmt::format("the phrase '{}' is empty or comes twice", phrase.text));
      }
      for (const auto& word : split_words(phrase.text)) {
        if (!book.pronunciations.contains(word)) {
          return at(path, node["text"], fmt::format("the word '{}' has no entry in pronunciations", word));
        }
      }
      book.phrases.push_back(phrase);
    }
    if (book.phrases.empty()) {
      return at(path, root["phrases"], "there is no phrase");
    }
    return book;
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("{}:{}: {}", path, e.mark.line + 1, e.msg)};
  }
}

}  // namespace nido
