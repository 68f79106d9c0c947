#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <array>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

namespace nido::sim {

// Reads a map of a YAML file and remembers the first thing that is wrong, with file, line, what was found and
// what is allowed. Getters return the fallback after trouble.
class YamlReader {
 public:
  YamlReader(YAML::Node node, std::string file, std::string place);

  // Complains about keys that are not in the list, and about a node that is not a map.
  void allow(std::initializer_list<const char*> keys);
  [[nodiscard]] bool has(const char* key) const;
  [[nodiscard]] YAML::Node node(const char* key) const;
  // A map below this one; its trouble must be taken over with adopt().
  [[nodiscard]] YamlReader child(const char* key) const;
  [[nodiscard]] YamlReader item(const char* key, std::size_t index) const;
  [[nodiscard]] std::size_t count(const char* key);

  std::string text(const char* key, const std::string& fallback);
  // One of these.
  std::string choice(const char* key, const std::string& fallback,
                     std::initializer_list<const char*> allowed);
  bool flag(const char* key, bool fallback);
  // Finite and within the bounds.
  double number(const char* key, double fallback, double lowest, double highest);
  std::vector<double> numbers(const char* key, std::vector<double> fallback, std::size_t fewest,
                              std::size_t most, double lowest, double highest);
  Eigen::Vector3d vector(const char* key, const Eigen::Vector3d& fallback, double lowest, double highest);
  std::vector<std::string> names(const char* key);

  void complain(const char* key, const std::string& what);
  void adopt(const YamlReader& other) {
    if (trouble_.empty()) trouble_ = other.trouble_;
  }
  [[nodiscard]] bool ok() const { return trouble_.empty(); }
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  YAML::Node node_;
  std::string file_;
  std::string place_;
  std::string trouble_;
};

}  // namespace nido::sim
