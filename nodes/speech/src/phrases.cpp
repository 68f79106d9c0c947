#include "nido/speech/phrases.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
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

// the file beside the phrases: what is said besides
Status load_other_words(const std::string& path, PhraseBook& book) {
  const YAML::Node root = YAML::LoadFile(path);
  if (!root.IsMap()) return at(path, root, "expected a map with the sections interruptions, other_words");
  for (const auto& entry : root) {
    const auto key = entry.first.as<std::string>();
    if (key != "interruptions" && key != "other_words") {
      return at(path, entry.first,
                fmt::format("unknown section '{}'; allowed are interruptions, other_words", key));
    }
  }
  for (const auto& [key, list] :
       {std::pair{"interruptions", &book.interruptions}, {"other_words", &book.other_words}}) {
    if (!root[key]) continue;
    const auto texts = section(path, root, key, true);
    if (!texts) return texts.error();
    for (const auto& node : *texts) {
      list->push_back(fmt::format("{}", fmt::join(split_words(node.as<std::string>()), " ")));
      const std::string& text = list->back();
      const bool interruption = list == &book.interruptions;
      if (text.empty() || book.find(text))
        return at(path, node, fmt::format("'{}' is empty or a phrase", text));
      for (const auto& word : split_words(text)) {
        if (interruption && !book.pronunciations.contains(word)) {
          return at(path, node, fmt::format("the word '{}' has no entry in pronunciations", word));
        }
      }
      if (!interruption && (split_words(text).size() != 1 || book.pronunciations.contains(text))) {
        return at(path, node, fmt::format("'{}' is not one word, or a word of the phrases", text));
      }
    }
  }
  return {};
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

std::vector<SpokenOrder> split_orders(const std::string& text) {
  std::vector<SpokenOrder> orders;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ';');) {
    auto words = split_words(part);
    SpokenOrder order;
    if (!words.empty() && words[0].size() > 1 && words[0][0] == '@') {
      double at_s = 0.0;
      const char* end = words[0].data() + words[0].size();
      const auto [read, fault] = std::from_chars(words[0].data() + 1, end, at_s);
      if (fault == std::errc{} && read == end && std::isfinite(at_s) && at_s >= 0.0) {
        order.at_s = at_s;
        words.erase(words.begin());
      }
    }
    if (words.empty()) continue;
    order.text = fmt::format("{}", fmt::join(words, " "));
    orders.push_back(std::move(order));
  }
  return orders;
}

std::optional<Verb> verb_of(const std::string& name) {
  const auto found = std::find_if(kAllVerbs.begin(), kAllVerbs.end(),
                                  [&](Verb candidate) { return name == verb_name(candidate); });
  if (found == kAllVerbs.end()) return std::nullopt;
  return *found;
}

bool PhraseBook::interrupts(const std::string& text) const {
  return std::find(interruptions.begin(), interruptions.end(), text) != interruptions.end();
}

std::vector<std::string> PhraseBook::texts() const {
  std::vector<std::string> all;
  for (const auto& phrase : phrases) all.push_back(phrase.text);
  all.insert(all.end(), interruptions.begin(), interruptions.end());
  for (const auto& name : names) {
    for (const Order& order : orders_about(name)) all.push_back(order.text);
    all.push_back(kNaming + name);
  }
  if (corrections) {
    for (const char* const direction : kDirections) all.push_back(std::string(kCorrection) + direction);
  }
  return all;
}

bool PhraseBook::corrects(const std::string& text) const {
  return corrections && std::any_of(kDirections.begin(), kDirections.end(), [&](const char* direction) {
           return text == std::string(kCorrection) + direction;
         });
}

std::vector<Order> PhraseBook::orders_about(const std::string& name) const {
  std::vector<Order> orders;
  for (const Phrase& phrase : phrases) {
    const std::string& model = objects.front().name;
    const std::size_t at = phrase.text.find(model);
    if (phrase.object_index != 0 || at == std::string::npos) continue;
    orders.push_back(
        {phrase.text.substr(0, at) + name + phrase.text.substr(at + model.size()), phrase.verb, name});
  }
  return orders;
}

std::optional<Order> PhraseBook::order_in(const std::string& text) const {
  if (std::find(names.begin(), names.end(), text) != names.end()) return Order{text, Verb::kLook, text};
  const std::string gap = "*";
  for (const Order& pattern : orders_about(gap)) {
    const std::size_t at = pattern.text.find(gap);
    const std::string before = pattern.text.substr(0, at);
    const std::string after = pattern.text.substr(at + 1);
    if (before.size() + after.size() == 0 || text.size() <= before.size() + after.size() ||
        !text.starts_with(before) || !text.ends_with(after)) {
      continue;
    }
    return Order{text, pattern.verb, text.substr(before.size(), text.size() - before.size() - after.size())};
  }
  return std::nullopt;
}

std::size_t PhraseBook::take_order(const Order& order) {
  if (const auto known = find(order.text)) return *known;
  const auto same = std::find_if(objects.begin(), objects.end(),
                                 [&](const NamedObject& object) { return object.name == order.name; });
  const auto index = static_cast<std::size_t>(same - objects.begin());
  if (same == objects.end()) objects.push_back({order.name, "", ""});
  phrases.push_back({order.text, order.verb, index});
  return phrases.size() - 1;
}

bool PhraseBook::names_a_thing(const std::string& text) const {
  return std::any_of(names.begin(), names.end(),
                     [&](const std::string& name) { return text == kNaming + name; });
}

Status PhraseBook::add_name(const std::string& name) {
  const std::string clean = fmt::format("{}", fmt::join(split_words(name), " "));
  if (clean.empty() || names_a_thing(kNaming + clean)) {
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("'{}' is known already as a name, or empty", clean)};
  }
  std::string said = kNaming + clean;
  for (const Order& order : orders_about(clean)) said += " " + order.text;
  for (const auto& word : split_words(said)) {
    if (!pronunciations.contains(word)) {
      return Error{ErrorCode::kInvalidArgument, fmt::format("the word '{}' has no pronunciation", word)};
    }
  }
  names.push_back(clean);
  return {};
}

Status PhraseBook::add(const std::string& text, Verb verb, const NamedObject& object) {
  const auto refuse = [](const std::string& sentence) {
    return Error{ErrorCode::kInvalidArgument, sentence};
  };
  const std::string clean = fmt::format("{}", fmt::join(split_words(text), " "));
  if (clean.empty()) return refuse("there is no text to add");
  if (find(clean) || interrupts(clean)) return refuse(fmt::format("'{}' is known already", clean));
  for (const auto& word : split_words(clean)) {
    if (!pronunciations.contains(word)) {
      return refuse(fmt::format("the word '{}' has no pronunciation", word));
    }
  }
  const auto known = std::find_if(objects.begin(), objects.end(), [&](const NamedObject& candidate) {
    return candidate.name == object.name;
  });
  if (known != objects.end() && (known->colour != object.colour || known->shape != object.shape)) {
    return refuse(fmt::format("the {} is known as {} {}, not {} {}", object.name, known->colour, known->shape,
                              object.colour, object.shape));
  }
  const auto index = static_cast<std::size_t>(known - objects.begin());
  if (known == objects.end()) objects.push_back(object);
  phrases.push_back({clean, verb, index});
  return {};
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
      const auto found_verb = verb_of(verb);
      if (!found_verb) {
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
    const auto beside = std::filesystem::path(path).parent_path() / "other_words.yaml";
    if (std::filesystem::exists(beside)) {
      if (const Status read = load_other_words(beside.string(), book); !read) return read.error();
    }
    return book;
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidArgument, fmt::format("{}:{}: {}", path, e.mark.line + 1, e.msg)};
  }
}

}  // namespace nido
