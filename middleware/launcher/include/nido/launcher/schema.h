#pragma once

#include <yaml-cpp/yaml.h>

#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "nido/interfaces/result.h"

namespace nido {

// What a value in a config file may be.
enum class ValueKind {
  kText,
  kFlag,         // true or false
  kInteger,      // whole number
  kNumber,       // finite number
  kNumberOrMax,  // positive number, or the word max
  kTextList,     // [a, b]
  kTextMap,      // {a: text, b: text}
  kAnyMap,       // a map whose content belongs to somebody else: kept as it is
  kMap,          // a map with the fields of `inner`
  kList,         // a list of maps with the fields of `inner`
};

struct Schema;

// One key of a config map: the only place where its meaning, bounds and default are written.
struct Field {
  std::string key{};
  ValueKind kind = ValueKind::kText;
  bool required = false;
  std::string fallback{};              // YAML text of the default; empty: the key stays absent
  std::string meaning{};               // for people
  std::vector<std::string> allowed{};  // kText: the words that may stand here; empty: any text
  double min = -std::numeric_limits<double>::infinity();  // kInteger, kNumber
  double max = std::numeric_limits<double>::infinity();   // kInteger, kNumber
  const Schema* inner = nullptr;                          // kMap, kList
  // kText, kTextList: says what is wrong with a text; empty if nothing is.
  std::function<std::string(const std::string&)> rule{};
};

// The keys that a map may have, in the order in which it is printed.
struct Schema {
  std::string what;      // "process": for sentences
  std::string name_key;  // key that names one item of a list ("name"); its values must differ. Empty: items
                         // have no names
  std::vector<Field> fields;
};

// A value given on the command line, which goes before the one in the file.
struct Override {
  std::string path;  // dotted: "processes.vision.period_s"; items of a list by name
  YAML::Node value;
  std::string origin;  // "--set vision.period_s=0.02": named in place of file and line
};

// Reads a YAML file. kNotFound if it is not there, kInvalidArgument with file and line if it is no YAML.
Result<YAML::Node> read_yaml(const std::string& file);

// Sets a value in a document that was read but not checked yet. Missing maps on the way are made; a list item
// that is not there is refused.
Status apply_override(YAML::Node& document, const Schema& schema, const Override& override_);

// Checks a document against a schema and returns it with every default filled in, in the schema's order. The
// first wrong key or value is refused (kInvalidArgument) with file, line, what was found and what is allowed.
Result<YAML::Node> check_document(const YAML::Node& document, const Schema& schema, const std::string& file,
                                  const std::vector<Override>& overrides = {});

// The schema as a table for people: key, default, meaning.
std::string describe(const Schema& schema);

}  // namespace nido
