#include "yaml_reader.h"

#include <algorithm>
#include <cmath>

namespace nido::sim {
namespace {

std::string plain(double value) {
  std::string text = std::to_string(value);
  while (text.size() > 1 && text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace

YamlReader::YamlReader(YAML::Node node, std::string file, std::string place)
    : node_(std::move(node)), file_(std::move(file)), place_(std::move(place)) {}

void YamlReader::complain(const char* key, const std::string& what) {
  if (!trouble_.empty()) return;
  // the other operator[] makes the entry that it does not find, also under the feet of a loop
  const YAML::Node& node = node_;
  YAML::Mark mark = node.Mark();
  if (key != nullptr && node.IsMap() && node[key]) mark = node[key].Mark();
  trouble_ = file_;
  if (!mark.is_null()) trouble_ += " line " + std::to_string(mark.line + 1);
  trouble_ += ": " + place_;
  if (key != nullptr) trouble_ += std::string(place_.empty() ? "" : ".") + key;
  trouble_ += " " + what;
}

void YamlReader::allow(std::initializer_list<const char*> keys) {
  if (!node_.IsMap()) {
    complain(nullptr, "must be a map of keys and values");
    return;
  }
  for (const auto& entry : node_) {
    const auto key = entry.first.as<std::string>("");
    if (std::any_of(keys.begin(), keys.end(), [&](const char* k) { return key == k; })) continue;
    std::string allowed;
    for (const char* k : keys) allowed += (allowed.empty() ? "" : ", ") + std::string(k);
    complain(key.c_str(), "is no key here; allowed are " + allowed);
  }
}

bool YamlReader::has(const char* key) const { return node_.IsMap() && node_[key].IsDefined(); }

YAML::Node YamlReader::node(const char* key) const { return has(key) ? node_[key] : YAML::Node(); }

YamlReader YamlReader::child(const char* key) const {
  return {node(key), file_, place_ + (place_.empty() ? "" : ".") + key};
}

YamlReader YamlReader::item(const char* key, std::size_t index) const {
  return {node(key)[index], file_,
          place_ + (place_.empty() ? "" : ".") + key + "[" + std::to_string(index) + "]"};
}

std::size_t YamlReader::count(const char* key) {
  if (!has(key)) return 0;
  if (!node_[key].IsSequence()) {
    complain(key, "must be a list");
    return 0;
  }
  return node_[key].size();
}

std::string YamlReader::text(const char* key, const std::string& fallback) {
  if (!has(key)) return fallback;
  if (!node_[key].IsScalar() || node_[key].Scalar().empty()) {
    complain(key, "must be a word");
    return fallback;
  }
  return node_[key].Scalar();
}

std::string YamlReader::choice(const char* key, const std::string& fallback,
                               std::initializer_list<const char*> allowed) {
  const std::string found = text(key, fallback);
  if (std::any_of(allowed.begin(), allowed.end(), [&](const char* a) { return found == a; })) return found;
  std::string list;
  for (const char* a : allowed) list += (list.empty() ? "" : ", ") + std::string(a);
  complain(key, "is \"" + found + "\"; allowed are " + list);
  return fallback;
}

bool YamlReader::flag(const char* key, bool fallback) {
  if (!has(key)) return fallback;
  bool value = fallback;
  if (!YAML::convert<bool>::decode(node_[key], value)) complain(key, "must be true or false");
  return value;
}

double YamlReader::number(const char* key, double fallback, double lowest, double highest) {
  if (!has(key)) return fallback;
  double value = 0;
  if (!node_[key].IsScalar() || !YAML::convert<double>::decode(node_[key], value) || !std::isfinite(value)) {
    complain(key, "must be a number");
    return fallback;
  }
  if (value < lowest || value > highest) {
    complain(key, "is " + plain(value) + "; allowed are " + plain(lowest) + " to " + plain(highest));
    return fallback;
  }
  return value;
}

std::vector<double> YamlReader::numbers(const char* key, std::vector<double> fallback, std::size_t fewest,
                                        std::size_t most, double lowest, double highest) {
  if (!has(key)) return fallback;
  const YAML::Node list = node_[key];
  if (!list.IsSequence() || list.size() < fewest || list.size() > most) {
    complain(key, "must be a list of " + std::to_string(fewest) +
                      (most == fewest ? "" : " to " + std::to_string(most)) + " numbers");
    return fallback;
  }
  std::vector<double> values;
  for (const YAML::Node& item : list) {
    double value = 0;
    if (!item.IsScalar() || !YAML::convert<double>::decode(item, value) || !std::isfinite(value)) {
      complain(key, "must be a list of numbers");
      return fallback;
    }
    if (value < lowest || value > highest) {
      complain(key, "has " + plain(value) + " in it; allowed are " + plain(lowest) + " to " + plain(highest));
      return fallback;
    }
    values.push_back(value);
  }
  return values;
}

Eigen::Vector3d YamlReader::vector(const char* key, const Eigen::Vector3d& fallback, double lowest,
                                   double highest) {
  const std::vector<double> v =
      numbers(key, {fallback.x(), fallback.y(), fallback.z()}, 3, 3, lowest, highest);
  return {v[0], v[1], v[2]};
}

std::vector<std::string> YamlReader::names(const char* key) {
  std::vector<std::string> result;
  for (std::size_t i = 0; i < count(key); ++i) {
    if (!node_[key][i].IsScalar() || node_[key][i].Scalar().empty()) {
      complain(key, "must be a list of names");
      return {};
    }
    result.push_back(node_[key][i].Scalar());
  }
  return result;
}

}  // namespace nido::sim
